"""Records: what a class may not hide is said where it is made."""

import pickle

import pytest

import swarm
from swarm.kernel.record import Record
from swarm.methods.contract import MethodNumbers
from swarm.surfaces.contract import Smooth


class Pair(Record):
    one: float
    other: float = 2.0

    def total(self):
        return self.one + self.other


class Larger(Pair):
    def total(self):
        return 1.0 + super().total()


def test_a_record_is_a_named_tuple_with_base_classes():
    made = Larger(1.0)
    assert (made.total(), made, made._fields) == (4.0, (1.0, 2.0), ("one", "other"))
    assert type(made._replace(one=3.0)) is Larger
    assert pickle.loads(pickle.dumps(made)) == made
    assert pickle.loads(pickle.dumps(made)).total() == 4.0


def a_field_more():
    class Triple(Pair):
        third: float


def a_field_and_a_method():
    class Bent(Record):
        bend: float

        def bend(self, r):
            return r


def a_field_and_a_property():
    class Bent(Record):
        size: float
        bend: float

        @property
        def bend(self):
            return 1.0


def a_default_before_a_field():
    class Early(Record):
        one: float = 1.0
        other: float


def too_few_arguments_of_a_surface():
    class Mine(Smooth):
        side: float

        def phi(self):
            return 0.0


def too_many_arguments_of_a_method():
    class Mine(MethodNumbers):
        def constants(self, mass, energy, scale2, more):
            return 0.0, 0.0, 0.0


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (a_field_more, ["Triple", "Pair", "third"]),
        (a_field_and_a_method, ["Bent.bend", "field or a method"]),
        (a_field_and_a_property, ["Bent.bend", "field or a method"]),
        (a_default_before_a_field, ["Early", "defaults"]),
        (too_few_arguments_of_a_surface, ["Mine.phi", "(self, r)", "Smooth.phi", "(self)"]),
        (too_many_arguments_of_a_method, ["Mine.constants", "(self, mass, energy, scale2)", "more"]),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_what_would_be_hidden_is_refused(make, parts):
    with pytest.raises(swarm.SceneError) as caught:
        make()
    message = str(caught.value)
    assert "\n" not in message
    assert all(part in message for part in parts), message
