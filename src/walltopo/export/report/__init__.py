"""`report.html`: what went well and what did not, one self-contained file."""

from walltopo.export.report.facts import Facts
from walltopo.export.report.page import report_html

__all__ = ["Facts", "report_html"]
