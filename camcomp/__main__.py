"""`python -m camcomp`."""

from camcomp.terminal.cli import main

if __name__ == "__main__":
    main()
