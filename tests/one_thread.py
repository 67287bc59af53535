"""One thread a process for BLAS, set before numpy is loaded.

Its threads spin while they wait for a core that something else keeps busy: a test then takes ten
times as long.
"""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
