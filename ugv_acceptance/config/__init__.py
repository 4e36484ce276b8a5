"""From a robot's YAML file and URDF to validated settings: the one place with defaults and checks.

In: the path of a YAML file (or the name of one that ships), which names a URDF. Out: `Config`, with
the `Settings` of an evaluation, the topics, and a hash of both files; criteria.py does the same for
acceptance criteria. Every error is a BadConfig with file, line and field. Read loading.py first
(`load`), then schema.py (the keys of the file) and build.py (how file and URDF are combined).
docs/robot_configuration.md explains every key of the file.
"""

from ugv_acceptance.config.loading import Config, description_topic, load, name_and_topics
from ugv_acceptance.config.strength import Worst, worst_torques
from ugv_acceptance.config.topics import Topic, Topics
from ugv_acceptance.config.units import quantity
from ugv_acceptance.config.urdf import rotation_from_rpy

__all__ = [
    'Config',
    'Topic',
    'Topics',
    'Worst',
    'description_topic',
    'load',
    'name_and_topics',
    'quantity',
    'rotation_from_rpy',
    'worst_torques',
]
