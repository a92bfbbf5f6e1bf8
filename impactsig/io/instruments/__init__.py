"""Audio files and files of measuring instruments: TDMS, UFF, IDE, MDF, Vallen."""
