"""Stage *propose*: holds that stand out of the wall and that few masks or none tell of."""
