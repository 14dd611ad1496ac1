"""`python -m bench NAME`."""

import argparse
import sys
from pathlib import Path

from . import (
    accuracy,
    bars,
    bodies,
    cluster,
    collisions,
    compare,
    compiling,
    contacts,
    endurance,
    fields,
    grains,
    laws,
    meshes,
    motion,
    order,
    pairs,
    plane,
    report,
    scenes,
    stability,
    sweeps,
    throughput,
    unions,
)
from .peers import race


def _count(text: str) -> int:
    """A number that is 1 or more."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"must be a number of 1 or more, got {text}")
    return int(text)


def main() -> None:
    """Run one benchmark."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("throughput", help="every method, scene, number of particles, threads and output; the limits")
    commands.add_parser("accuracy", help="work-precision diagrams of every method, a picture a scene")
    commands.add_parser(
        "stability", help="maps of where methods fail: stiffness, Uzawa's loop, thin solids, grazing, round-off"
    )
    commands.add_parser(
        "order", help="the order of contact steps, begun at the impact or centred, in every kind of wall"
    )
    commands.add_parser("bars", help="speed, memory, start-up and accuracy against their bars")
    commands.add_parser("peers", help="the same job by other programs, those that are installed")
    commands.add_parser("endurance", help="checkpoints, memory over many frames, reading a large trajectory")
    some = commands.add_parser("scenes", help="nanoseconds an impact in scenes from one sphere to the fullest")
    some.add_argument(
        "--scenes", metavar="NAME", nargs="+", choices=list(scenes.SCENES), help="these alone, and nothing is written"
    )
    commands.add_parser(
        "plane", help="nanoseconds an impact in billiards of two dimensions: outlines of lines and arcs"
    )
    commands.add_parser("contacts", help="sliding, resting, chattering and wedges against their bars and soft walls")
    commands.add_parser("bodies", help="a step and an impact of bodies of several points, and what they conserve")
    commands.add_parser("motion", help="walls that move and walls that are moved: exactness, conservation, speed")
    commands.add_parser(
        "fields", help="scenes of many bodies, and the log of impacts: speed, first calls, what is kept"
    )
    commands.add_parser("laws", help="laws of walls: what an impact costs under each, the books, first calls")
    commands.add_parser("unions", help="vessels of several parts: what an impact costs beside one of them, first calls")
    commands.add_parser("collisions", help="balls that meet: what a collision costs, memory, first calls, how exact")
    commands.add_parser("grains", help="soft balls: what a grain and step costs, at rest and as they fall, how exact")
    commands.add_parser("meshes", help="meshes of triangles: the scene, its memory, an impact, the first call")
    first = commands.add_parser("compile", help="first calls: processor time, functions compiled, and the next process")
    first.add_argument(
        "--scenes", metavar="NAME", nargs="+", choices=list(compiling.CASES),
        help="the report has these alone [default: all]: " + ", ".join(compiling.CASES),
    )  # fmt: skip
    first.add_argument(
        "--repeats", metavar="N", type=_count, default=compiling.REPEATS, help="of each scene [default: %(default)s]"
    )
    commands.add_parser("pairs", help="which walls, capabilities and engines go together, each cell by a short run")
    commands.add_parser("sweep", help="many short runs: the wall time beside its parts, the memory of a thousand")
    commands.add_parser("cluster", help="two workers against two threads, and what 200 shards take of a scheduler")
    for command in commands.choices.values():
        command.add_argument(
            "--quick", action="store_true", help="a few seconds, to see that it runs; nothing is written"
        )
        command.add_argument(
            "-o", metavar="FOLDER", type=Path, default=report.OUT,
            help="of the table and the pictures [default: %(default)s]; bench/results has those of the READMEs",
        )  # fmt: skip
    comparison = commands.add_parser("compare", help="what got slower from one report to another")
    comparison.add_argument("old", type=Path, help="a CSV of bench/results")
    comparison.add_argument("new", type=Path)
    arguments = parser.parse_args()
    if arguments.command == "compare":
        sys.exit(compare.main(arguments.old, arguments.new))
    reports = {
        "throughput": throughput,
        "accuracy": accuracy,
        "stability": stability,
        "order": order,
        "pairs": pairs,
        "bars": bars,
        "peers": race,
        "scenes": scenes,
        "plane": plane,
        "contacts": contacts,
        "bodies": bodies,
        "motion": motion,
        "fields": fields,
        "laws": laws,
        "unions": unions,
        "meshes": meshes,
        "compile": compiling,
        "sweep": sweeps,
        "cluster": cluster,
        "collisions": collisions,
        "grains": grains,
        "endurance": endurance,
    }
    if arguments.quick:
        report.be_quick()
    else:
        report.write_to(arguments.o)
    before = report.stolen()
    options = {name: value for name, value in vars(arguments).items() if name not in ("command", "o")}
    reports[arguments.command].main(**options)
    print(report.told_of_others(before))


if __name__ == "__main__":
    main()
