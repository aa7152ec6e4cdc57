"""Entry point of python3 -m waymark.academy."""

import sys

from .run import main

sys.exit(main())
