"""Audio files and those of measuring instruments: TDMS, UFF, IDE, MDF, Vallen."""
