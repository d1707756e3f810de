"""The command line: one module for each subcommand of `drake-disasm`."""

import os

# Parallel work is done by processes, of one thread each. NumPy asks when it is loaded.
os.environ.setdefault("OMP_NUM_THREADS", "1")
