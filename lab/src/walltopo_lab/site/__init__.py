"""The documentation as a site: pages that only it has, and what `zensical` builds from."""
