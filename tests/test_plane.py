"""Scenes of two dimensions: starts, walls and pictures in a plane, and what would leave it."""

import math

import numpy as np
import pytest
from bounded import refused

import swarm
from swarm import scene_file
from swarm.kernel.vector import cross, dot

PLANES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}
