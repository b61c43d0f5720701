"""Run a command of `walltopo` at the lowest priority; it ends when its parent does.

`python -m walltopo_gym.scans.low_priority WORDS`
"""

import os
import sys

from walltopo.cli import main
from walltopo.core.children import end_with_parent

if __name__ == "__main__":
    os.nice(19)
    end_with_parent()
    sys.exit(main(sys.argv[1:]))
