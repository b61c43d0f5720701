"""`report.html`: what went well and what did not, one self-contained file."""

from walltopo.export.report.page import write_report

__all__ = ["write_report"]
