"""Printed documents: pages, tables and QR codes as PDF, in a font with Europe's letters."""
