"""How much memory and time a program may take that reads a stranger's file with native code.

It is imported inside that process (`own_process.py`), and needs nothing but Python.
"""

from time import process_time


def limit_work(*, memory: int, seconds: int) -> None:
    """Bound this process's address space, bytes, and its further time, seconds, where the system can."""
    try:
        import resource  # not on Windows
    except ImportError:
        return
    time = seconds + int(process_time())  # after the libraries were loaded
    for kind, wanted in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, time), (resource.RLIMIT_CORE, 0)):
        most = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (wanted if most == resource.RLIM_INFINITY else min(wanted, most), most))
