"""`python -m ins_eval`: the same as `ins-eval`, where no script is on the path."""

import sys

from ins_eval.cli import main

if __name__ == "__main__":
    sys.exit(main())
