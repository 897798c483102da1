"""Reports in the formats of CI systems and other tools."""
