"""The monitor on a robot: `ros2 launch ugv_acceptance monitor.launch.py config:=my_robot.yaml`."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode
from launch_ros.parameter_descriptions import ParameterValue

# The arguments that are parameters of the node, with their types.
PARAMETERS = {
    'config': str,
    'urdf': str,
    'publish_rate': float,
    'black_box': str,
    'use_sim_time': bool,
    'autostart': bool,
    'lock_parameters': bool,
}


def monitor(context: LaunchContext) -> list[LifecycleNode]:
    """Return the monitor as a lifecycle node; it brings itself up unless autostart is false.

    An argument that is empty is no parameter, so that it does not replace that of the file.
    """
    parameters = {
        name: ParameterValue(LaunchConfiguration(name), value_type=kind)
        for name, kind in PARAMETERS.items()
        if context.perform_substitution(LaunchConfiguration(name))
    }
    file = context.perform_substitution(LaunchConfiguration('params_file'))
    return [
        LifecycleNode(
            package='ugv_acceptance',
            executable='acceptance_monitor',
            name='acceptance_monitor',
            namespace=LaunchConfiguration('namespace'),
            output='screen',
            parameters=[*filter(None, (file, parameters))],
            respawn=LaunchConfiguration('respawn'),
            respawn_delay=float(context.perform_substitution(LaunchConfiguration('respawn_delay'))),
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """Return the monitor with its arguments; those that are empty leave it to the file."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'params_file',
                default_value='',
                description='YAML file of parameters of the node; arguments below count before it',
            ),
            DeclareLaunchArgument(
                'config',
                default_value='',
                description='YAML file that describes the robot, or the name of one that ships; '
                'empty: as params_file says, else packbot',
            ),
            DeclareLaunchArgument(
                'urdf',
                default_value='',
                description='URDF in place of the one the YAML names; empty: as params_file says',
            ),
            DeclareLaunchArgument(
                'publish_rate',
                default_value='',
                description='margin messages a second, 0: one for every input message; '
                'empty: as params_file says, else 25',
            ),
            DeclareLaunchArgument(
                'black_box',
                default_value='',
                description='folder for a recording of each critical alert; '
                'empty: as params_file says, else none is made',
            ),
            DeclareLaunchArgument(
                'namespace', default_value='', description='namespace of the robot'
            ),
            DeclareLaunchArgument(
                'use_sim_time',
                default_value='',
                description='true: take the time from /clock; empty: as params_file says',
            ),
            DeclareLaunchArgument(
                'autostart',
                default_value='',
                description='true: configure and activate at once; false: a lifecycle manager '
                'does; empty: as params_file says, else true',
            ),
            DeclareLaunchArgument(
                'lock_parameters',
                default_value='',
                description='true: no limit or delay can be set while the monitor is active; '
                'empty: as params_file says, else false',
            ),
            DeclareLaunchArgument(
                'respawn',
                default_value='false',
                description='true: start the node again whenever it ends by itself',
            ),
            DeclareLaunchArgument(
                'respawn_delay', default_value='2.0', description='seconds until then'
            ),
            OpaqueFunction(function=monitor),
        ]
    )
