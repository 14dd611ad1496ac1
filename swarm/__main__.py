"""`python -m swarm` is the command `swarm`."""

from .common import interrupt


def main() -> None:
    """Run the command line."""
    with interrupt.at_once():
        from .commands.cli import main as command
    command()


if __name__ == "__main__":
    main()
