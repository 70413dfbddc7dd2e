"""`python -m camcomp`."""

from camcomp.cli import main

if __name__ == "__main__":
    main()
