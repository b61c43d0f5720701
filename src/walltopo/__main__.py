"""`python -m walltopo`."""

import sys

from walltopo.cli import main

sys.exit(main())
