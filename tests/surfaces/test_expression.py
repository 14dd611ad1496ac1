"""What a formula may say, and that everything else is an error that shows where."""

import math

import pytest
import sympy

import swarm
from swarm.surfaces.formulas.expression import FUNCTIONS, parse

x, y, z = sympy.symbols("x y z")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x**2/0.09 + y**2/0.09 + z**4/0.13 - 1", 100 * x**2 / 9 + 100 * y**2 / 9 + 100 * z**4 / 13 - 1),
        ("  -(x - +y)*2e-3 ", -(x - y) / 500),
        ("sin(pi*x)", sympy.sin(sympy.Rational(math.pi) * x)),
        ("x**0.5 + x**(-1/3)", sympy.sqrt(x) + x ** sympy.Rational(-1, 3)),
        ("x\n + y", x + y),
        ("a*x + b", sympy.Symbol("p0") * x + sympy.Symbol("p1")),
    ],
)
def test_what_is_allowed(text, expected):
    assert sympy.simplify(parse(text, ("a", "b")) - expected) == 0


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function(name):
    assert float(parse(f"{name}(x)").subs(x, 0.7)) == pytest.approx(FUNCTIONS[name](0.7), rel=1e-14)


def test_a_constant_is_rounded_once():
    """0.09 as it is written, so 1/0.09 is the nearest number to 100/9."""
    assert float(parse("x/0.09").coeff(x)) == 100 / 9


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["x, y, z", "got nothing"]),
        (3, ["a formula in quotes", "got 3"]),
        ("x + radius_1", ["unknown name 'radius_1'", "column 5"]),
        ("x + sine", ["unknown name 'sine'", "did you mean 'sin'?"]),
        ("x + y +", ["not a formula", "column"]),
        ("2x", ["not a formula", "column 1"]),
        ("x; y", ["not a formula", "column 2"]),
        ("x^2", ["write ** for a power"]),
        ("x + sine(y)", ["call only sqrt", "column 5", "did you mean 'sin'?"]),
        ("abs(x)", ["smooth", "abs"]),
        ("sin(x, y)", ["one argument"]),
        ("sin(x=y)", ["one argument"]),
        ("sin(*x)", ["a star"]),
        ("sin + x", ["write sin(...)"]),
        ("x.real", ["an attribute", "'x.real'"]),
        ("x[0]", ["an index"]),
        ("lambda: x", ["a lambda"]),
        ("x < 1", ["a comparison"]),
        ("x if y else z", ["'if'"]),
        ("x and y", ["'and' or 'or'"]),
        ("x % 2", ["must not have this"]),
        ("x // 2", ["must not have this"]),
        ("(x := 1)", ["an assignment"]),
        ("[x for x in y]", ["a comprehension"]),
        ("'x'", ["real numbers only"]),
        ("f'{x}'", ["a string"]),
        ("True*x", ["real numbers only"]),
        ("1j*x", ["real numbers only"]),
        ("import os", ["not a formula"]),
        ("__import__('os').system('true')", ["call only"]),
        ("().__class__.__bases__[0].__subclasses__()", ["call only"]),
        ("x.__class__", ["an attribute"]),
        ("exec('1')", ["call only"]),
        ("__builtins__ + x", ["unknown name '__builtins__'"]),
        ("9**9**9*x", ["exponents up to 64", "'9**9'"]),
        ("x**1000", ["exponents up to 64", "'1000'"]),
        ("x**y", ["constant exponents"]),
        ("1e200*x", ["numbers below"]),
        ("(9**64)**64*x", ["constants below"]),
        ("1e999*x", ["numbers below"]),
        ("x/0", ["divides by 0"]),
        ("x/(y - y)", ["divides by 0"]),
        ("0**(-1)*x", ["divides by 0"]),
        ("sqrt(-1)*x", ["not a real number"]),
        ("(-1)**0.5*x", ["not a real number"]),
        ("log(0) + x", ["not a real number"]),
        ("1 - 2", ["depend on x, y or z"]),
        ("x - x", ["depend on x, y or z"]),
        ("x" + "*x" * 1000, ["at most 2000 characters", "got 2001"]),
        ("-" * 900 + "x", ["deep"]),
        ("(" * 900 + "x" + ")" * 900, ["not a formula"]),
        ("+".join("x" * 900), ["deep"]),
        ("+".join(["(" + "+".join("x" * 50) + ")"] * 12), ["at most 400"]),
        ("x + \0", ["not a formula"]),
    ],
)
def test_everything_else_is_an_error(text, parts):
    with pytest.raises(swarm.SceneError) as caught:
        parse(text)
    message = str(caught.value)
    assert message.startswith("phi ")
    assert all(part in message for part in parts), message
    assert len(message) < 300


def test_powers_of_powers_of_numbers_stay_short():
    """An exact 1.0000001**(64**5) has a thousand million digits."""
    expression = parse("((((1.0000000001**64)**64)**64)**64)*x")
    assert float(expression.coeff(x)) == pytest.approx(math.exp(64**4 * math.log1p(1e-10)), rel=1e-10)


def test_columns_count_characters():
    with pytest.raises(swarm.SceneError, match="'ö' at column 9"):
        parse("  x + x*ö")
