"""The monitor on a robot: `ros2 launch ugv_acceptance monitor.launch.py config:=my_robot.yaml`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description() -> LaunchDescription:
    """Return the monitor as a lifecycle node; it brings itself up unless autostart is false."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'config',
                default_value='packbot',
                description='YAML file that describes the robot, or the name of one that ships',
            ),
            DeclareLaunchArgument(
                'urdf', default_value='', description='URDF in place of the one the YAML names'
            ),
            DeclareLaunchArgument(
                'namespace', default_value='', description='namespace of the robot'
            ),
            DeclareLaunchArgument(
                'use_sim_time', default_value='false', description='take the time from /clock'
            ),
            DeclareLaunchArgument(
                'autostart',
                default_value='true',
                description='configure and activate at once; false: a lifecycle manager does',
            ),
            DeclareLaunchArgument(
                'lock_parameters',
                default_value='false',
                description='true: no limit or delay can be set while the monitor is active',
            ),
            LifecycleNode(
                package='ugv_acceptance',
                executable='acceptance_monitor',
                name='acceptance_monitor',
                namespace=LaunchConfiguration('namespace'),
                output='screen',
                parameters=[
                    {
                        'config': ParameterValue(LaunchConfiguration('config'), value_type=str),
                        'urdf': ParameterValue(LaunchConfiguration('urdf'), value_type=str),
                        'use_sim_time': ParameterValue(
                            LaunchConfiguration('use_sim_time'), value_type=bool
                        ),
                        'autostart': ParameterValue(
                            LaunchConfiguration('autostart'), value_type=bool
                        ),
                        'lock_parameters': ParameterValue(
                            LaunchConfiguration('lock_parameters'), value_type=bool
                        ),
                    }
                ],
            ),
        ]
    )
