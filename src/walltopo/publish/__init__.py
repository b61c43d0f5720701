"""A finished scan as files for people and programs: glTF, viewer page, report, tables."""
