"""Write `report.html`, a quality report in one self-contained file."""

from walltopo.publish.report.page import Facts, report_html

__all__ = ["Facts", "report_html"]
