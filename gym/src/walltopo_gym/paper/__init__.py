"""Documents on paper: pages, tables and QR codes as PDF, in a font that has Europe's letters."""
