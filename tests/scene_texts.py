"""The text of a scene file, for tests of what reads such files."""


def in_a_sphere(run, count=10, before="", sweep=""):
    """Points with a speed in a sphere: the lines of the table [run], those before all tables, and those of [sweep]."""
    after = f"[sweep]\n{sweep}\n" if sweep else ""
    return f"""
{before}

[particles]
count = {count}
speed = 1.0

[[surface]]
kind = "sphere"
radius = 0.5

[method]
kind = "impact"

[run]
{run}
{after}"""
