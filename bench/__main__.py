"""`python -m bench NAME`."""

import argparse

from . import throughput


def main() -> None:
    """Run one benchmark."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("throughput", help="speed, memory, start-up and accuracy against their bars")
    command.add_argument("--quick", action="store_true", help="a few seconds, to see that it runs; nothing is written")
    throughput.main(quick=parser.parse_args().quick)


if __name__ == "__main__":
    main()
