"""Threads of a process that get no processor time, as beside busy programs."""
import contextlib
import ctypes
import os
import pathlib
import unittest

PTRACE_SEIZE, PTRACE_INTERRUPT, PTRACE_DETACH, WAIT_ALL = 0x4206, 0x4207, 17, 0x40000000


def niceness(pid, thread):
    stat = pathlib.Path(f"/proc/{pid}/task/{thread}/stat").read_text(encoding="ascii")
    return int(stat.rsplit(")", 1)[1].split()[16])


@contextlib.contextmanager
def stopped_threads(pid):
    """Stops the threads of higher niceness than the first one until the end of the block; yields their number."""
    ptrace = ctypes.CDLL(None, use_errno=True).ptrace
    ptrace.argtypes = [ctypes.c_long, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p]
    threads = []
    try:
        for thread in map(int, os.listdir(f"/proc/{pid}/task")):
            try:
                if niceness(pid, thread) <= niceness(pid, pid):
                    continue
            except FileNotFoundError:  # it has ended
                continue
            if ptrace(PTRACE_SEIZE, thread, None, None) != 0:
                raise unittest.SkipTest(f"ptrace: {os.strerror(ctypes.get_errno())}")
            threads.append(thread)
            ptrace(PTRACE_INTERRUPT, thread, None, None)
            os.waitpid(thread, WAIT_ALL)
        yield len(threads)
    finally:
        for thread in threads:
            if ptrace(PTRACE_DETACH, thread, None, None) != 0:  # it has ended
                os.waitpid(thread, WAIT_ALL)
