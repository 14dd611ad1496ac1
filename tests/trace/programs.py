"""Random functions of kernels, as text: expressions, branches, loops, records and arrays, of a seed."""

import random

# Arguments of every program: two floats, an int, a bool, a record (x, n, inner (y, flag)), five floats, 2 x 3 ints.
ARGUMENTS = "x, y, n, c, p, t, m"
_FLOATS = ("0.0", "-0.0", "1.0", "-1.5", "0.3", "1e300", "2.0", "7.0", "1e-310")
_INTS = ("0", "1", "2", "-1", "3", "-7", "5")
_DEEPEST = 2
# Lines from which on there are no more loops and branches.
_LONGEST = 10
_LIMIT = 1009


class _Writer:
    """Writes one program: text whose names are known to have a value of their type."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.lines = []
        self.names = {"f": ["x", "y", "p.x", "p.inner.y"], "i": ["n", "p.n"], "b": ["c", "p.inner.flag"], "r": ["p"]}
        # Names that must not be assigned: counters of loops that would not end.
        self.fixed = set()
        self.count = 0

    def pick(self, *ways):
        return self.random.choice(ways)()

    def one(self, kind):
        return self.random.choice(self.names[kind])

    # --- Expressions ---

    def number(self, kind, depth, signs, *ways):
        """A name, a literal, or, unless it is deep already, two numbers with a sign between them or another way."""
        number, literals = {"f": (self.f, _FLOATS), "i": (self.i, _INTS)}[kind]
        short = (lambda: self.one(kind), lambda: self.random.choice(literals))

        def two(sign):
            return lambda: f"({number(depth + 1)} {sign} {number(depth + 1)})"

        return self.pick(*short) if depth >= _DEEPEST else self.pick(*short, *map(two, signs), *ways)

    def f(self, depth=0):
        return self.number(
            "f",
            depth,
            ("+", "-", "*", "/", "+", "*"),
            lambda: f"({self.f(depth + 1)} {self.random.choice('+-*/')} {self.i(depth + 1)})",
            lambda: f"(-{self.f(depth + 1)})",
            lambda: f"abs({self.f(depth + 1)})",
            lambda: f"{self.random.choice(('max', 'min'))}({self.f(depth + 1)}, {self.f(depth + 1)})",
            lambda: f"np.sqrt({self.f(depth + 1)})",
            lambda: f"np.floor({self.f(depth + 1)})",
            lambda: f"{self.f(depth + 1)} ** {self.random.choice((0, 1, 2))}".join("()"),
            lambda: f"({self.f(depth + 1)} if {self.b(depth + 1)} else {self.f(depth + 1)})",
            lambda: f"select({self.b(depth + 1)}, {self.f(depth + 1)}, {self.f(depth + 1)})",
            lambda: f"t[{self.place(depth + 1, 5)}]",
            lambda: f"{self.one('r')}.x",
            lambda: f"float({self.i(depth + 1)})",
            lambda: f"({self.f(depth + 1)}, {self.f(depth + 1)})[{self.random.randrange(2)}]",
        )

    def i(self, depth=0):
        return self.number(
            "i",
            depth,
            ("+", "-", "*", "&", "|", "^"),
            lambda: f"({self.i(depth + 1)} // {self.random.choice((2, 3, -2))})",
            lambda: f"({self.i(depth + 1)} % {self.random.choice((2, 3, -5))})",
            lambda: f"(-{self.i(depth + 1)})",
            lambda: f"(~{self.i(depth + 1)})",
            lambda: f"abs({self.i(depth + 1)})",
            lambda: f"{self.random.choice(('max', 'min'))}({self.i(depth + 1)}, {self.i(depth + 1)})",
            lambda: f"({self.i(depth + 1)} if {self.b(depth + 1)} else {self.i(depth + 1)})",
            lambda: f"m[{self.place(depth + 1, 2)}, {self.place(depth + 1, 3)}]",
            lambda: f"{self.one('r')}.n",
            lambda: "t.size",
            lambda: f"m.shape[{self.random.randrange(2)}]",
        )

    def b(self, depth=0):
        if depth >= _DEEPEST:
            return self.pick(lambda: self.one("b"), lambda: self.random.choice(("True", "False")))

        def compare(kind):
            return lambda: f"({kind(depth + 1)} {self.sign()} {kind(depth + 1)})"

        return self.pick(
            lambda: self.one("b"),
            *map(compare, (self.f, self.f, self.i)),
            lambda: f"({self.f(depth + 1)} {self.sign()} {self.f(depth + 1)} {self.sign()} {self.f(depth + 1)})",
            lambda: f"({self.b(depth + 1)} {self.random.choice(('and', 'or'))} {self.b(depth + 1)})",
            lambda: f"(not {self.b(depth + 1)})",
            lambda: f"({self.i(depth + 1)} {self.random.choice(('in', 'not in'))} ({self.i(depth + 1)}, 3, 0))",
            lambda: f"np.isnan({self.f(depth + 1)})",
        )

    def r(self, depth=0):
        return self.pick(
            lambda: self.one("r"),
            lambda: f"Record({self.f(depth + 1)}, {self.held('i')}, Inner({self.f(depth + 1)}, {self.b(depth + 1)}))",
            lambda: f"({self.one('r')} if {self.b(depth + 1)} else {self.one('r')})",
        )

    def held(self, kind):
        """An expression for a variable; whole numbers stay small, since an overflow has no one result in a kernel."""
        return f"{self.i()} % {_LIMIT} - {_LIMIT // 2}" if kind == "i" else getattr(self, kind)()

    def sign(self):
        return self.random.choice(("<", "<=", ">", ">=", "==", "!="))

    def place(self, depth, size):
        return self.pick(
            lambda: str(self.random.randrange(-size, size)),
            lambda: f"({self.i(depth)} % {size})",
            lambda: f"({self.i(depth)} % {size} - {size})",
        )

    # --- Statements ---

    def line(self, depth, text):
        self.lines.append("    " * (depth + 1) + text)

    def fresh(self):
        self.count += 1
        return f"v{self.count}"

    def block(self, depth, loop, most=3):
        """Statements; names that are new in them are forgotten behind them."""
        known = {kind: list(names) for kind, names in self.names.items()}
        ends = False
        for _ in range(self.random.randint(1, most)):
            ends = self.statement(depth, loop)
            if ends:
                break
        self.names = known
        return ends

    def statement(self, depth, loop):
        ways = [self.assign, self.assign, self.assign, self.store, self.augment, self.swap]
        if depth < _DEEPEST and len(self.lines) < _LONGEST:
            ways += [self.branch, self.branch, self.both_ways, self.counted, self.known, self.while_loop]
        made = self.random.choice(ways)
        made(depth, loop)
        if depth and self.random.random() < 0.1:
            self.give(depth)
            return True
        if loop and self.random.random() < 0.15:
            self.line(depth, self.random.choice(("break", "continue")))
            return True
        return False

    def assign(self, depth, _loop):
        kind = self.random.choice("ffiibr")
        old = [one for one in self.names[kind] if one.isidentifier() and one not in self.fixed and one not in ("p",)]
        value = self.held(kind)
        if old and self.random.random() < 0.6:
            return self.line(depth, f"{self.random.choice(old)} = {value}")
        name = self.fresh()
        self.line(depth, f"{name} = {value}")
        self.names[kind].append(name)
        return None

    def augment(self, depth, _loop):
        old = [one for one in self.names["f"] if one.isidentifier()]
        if old:
            self.line(depth, f"{self.random.choice(old)} {self.random.choice('+-*')}= {self.f(1)}")

    def swap(self, depth, _loop):
        old = [one for one in self.names["f"] if one.isidentifier()]
        if len(old) > 1:
            first, second = self.random.sample(old, 2)
            self.line(depth, f"{first}, {second} = {second}, {self.f(2)} + {first}")

    def store(self, depth, _loop):
        self.pick(
            lambda: self.line(depth, f"t[{self.place(2, 5)}] = {self.f(1)}"),
            lambda: self.line(depth, f"t[{self.place(2, 5)}] += {self.f(1)}"),
            lambda: self.line(depth, f"m[{self.place(2, 2)}, {self.place(2, 3)}] = {self.held('i')}"),
        )

    def branch(self, depth, loop):
        self.line(depth, f"if {self.b()}:")
        self.block(depth + 1, loop)
        while self.random.random() < 0.3:
            self.line(depth, f"elif {self.b()}:")
            self.block(depth + 1, loop)
        if self.random.random() < 0.5:
            self.line(depth, "else:")
            self.block(depth + 1, loop)

    def both_ways(self, depth, _loop):
        """A variable whose first value is that of one way or the other."""
        name, kind = self.fresh(), self.random.choice("fibr")
        self.line(depth, f"if {self.b()}:")
        self.line(depth + 1, f"{name} = {self.held(kind)}")
        self.line(depth, "else:")
        self.line(depth + 1, f"{name} = {self.held(kind)}")
        self.names[kind].append(name)

    def counted(self, depth, _loop):
        """A loop whose bounds are known in the kernel only."""
        step = self.random.choice(("", "", ", -1", ", 2", ", -2"))
        bounds = (f"{self.i(2)} % 4", f"{self.i(2)} % 7 - 1")
        bounds = bounds[::-1] if "-" in step else bounds
        self.loop(
            depth, f"for {{}} in range({bounds[0]}, {bounds[1]}{step}):" if step else f"for {{}} in range({bounds[1]}):"
        )

    def known(self, depth, _loop):
        self.loop(depth, f"for {{}} in range({self.random.randrange(-1, 2)}, {self.random.choice((3, 6, 12))}):")

    def loop(self, depth, text):
        name = self.fresh()
        becomes = self.fresh() if self.random.random() < 0.4 else None
        if becomes:
            self.line(depth, f"{becomes} = 0")
        self.line(depth, text.format(name))
        known = {kind: list(names) for kind, names in self.names.items()}
        self.fixed.add(name)
        self.names["i"].append(name)
        if becomes:
            self.line(depth + 1, f"{becomes} = {becomes} + {self.f(2)}")
        self.block(depth + 1, True, 2)
        self.names = known
        if becomes:
            self.names["f"].append(becomes)

    def while_loop(self, depth, _loop):
        name = self.fresh()
        self.line(depth, f"{name} = 0")
        self.line(depth, f"while {name} < {self.random.choice((2, 5))} and {self.b(1)}:")
        known = {kind: list(names) for kind, names in self.names.items()}
        self.fixed.add(name)
        self.line(depth + 1, f"{name} += 1")
        self.names["i"].append(name)
        self.block(depth + 1, True, 2)
        self.names = known
        self.names["i"].append(name)

    def give(self, depth):
        self.line(depth, f"return {self.f(1)} + 0.0, {self.i(1)} + n * 0, {self.b(1)} or c, {self.one('r')}")


def program(seed, name="program"):
    """The text of a function of `ARGUMENTS` that returns a float, an int, a bool and a record."""
    writer = _Writer(seed)
    writer.lines.append(f"def {name}({ARGUMENTS}):")
    for _ in range(writer.random.randint(2, 5)):
        writer.statement(0, False)
    writer.give(0)
    return "\n".join(writer.lines) + "\n"
