"""Export a finished scan for people and programs: glTF, viewer page, report, tables."""
