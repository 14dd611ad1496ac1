"""`python -m bench NAME`."""

import argparse

from . import scenes, throughput


def main() -> None:
    """Run one benchmark."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("throughput", help="speed, memory, start-up and accuracy against their bars")
    commands.add_parser("scenes", help="nanoseconds an impact in scenes from one sphere to the fullest")
    for command in commands.choices.values():
        command.add_argument(
            "--quick", action="store_true", help="a few seconds, to see that it runs; nothing is written"
        )
    arguments = parser.parse_args()
    {"throughput": throughput, "scenes": scenes}[arguments.command].main(quick=arguments.quick)


if __name__ == "__main__":
    main()
