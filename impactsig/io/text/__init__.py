"""Tables of text: header, separator, decimal mark, columns; LabVIEW measurement files."""
