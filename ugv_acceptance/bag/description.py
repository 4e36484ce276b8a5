"""Decodes std_msgs/String, the message of /robot_description, without ROS (CDR or ROS 1)."""

from ugv_acceptance.bag.layout import Cursor, Wire

TYPE = 'std_msgs/msg/String'
TOPIC = '/robot_description'


def string_of(data: bytes, wire: Wire = 'cdr') -> str:
    """Return the text of a std_msgs/String; BadSample if it is none."""
    return Cursor(data, wire).text('data')
