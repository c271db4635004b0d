"""``python -m chainunit``: the command line."""

from .cli import main

main()
