"""A robot's YAML file and URDF to checked settings: the one place with defaults and validation.

`load` finds, reads and checks; `Config` is what it returns. docs/robot_configuration.md explains
every key of the file.
"""

from ugv_acceptance.config.loading import Config, load
from ugv_acceptance.config.strength import Worst, worst_torques
from ugv_acceptance.config.topics import Topic, Topics
from ugv_acceptance.config.units import quantity
from ugv_acceptance.config.urdf import rotation_from_rpy

__all__ = [
    'Config',
    'Topic',
    'Topics',
    'Worst',
    'load',
    'quantity',
    'rotation_from_rpy',
    'worst_torques',
]
