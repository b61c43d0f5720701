"""From a scan in review to the wall that all see: which route is which, and the change over."""
