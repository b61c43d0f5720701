"""The documentation site: its additional pages and the input folder of `zensical`."""
