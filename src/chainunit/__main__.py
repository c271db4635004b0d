"""The program ``chainunit``: the command line, in a process of its own.

Signals are handled before the command line is imported, and until the process has ended.
"""

from __future__ import annotations

import os
import signal


def main() -> None:
    """Run the command line; see `chainunit.app.cli.main`."""
    status = 130
    try:
        from .work import interrupts

        interrupts.begin()
        try:
            from .app import cli
            from .report import console
        except Exception:
            # a library may turn the interrupt of its import into another error
            if interrupts.received() is None:
                raise
            raise KeyboardInterrupt from None
        console.show_only_remarks()
        try:
            cli.main()
        finally:
            # at the end of a process Python takes its handlers away
            signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:
        if "interrupts" in locals():
            status = interrupts.status()
        os.write(2, b"chainunit: interrupted; nothing was written\n")
        os._exit(status)


if __name__ == "__main__":
    main()
