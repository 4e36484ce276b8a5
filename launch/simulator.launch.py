"""A simulated robot and its monitor: `ros2 launch ugv_acceptance simulator.launch.py`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the simulated robot, obeying cmd_vel and joint trajectories, and the monitor."""
    monitor = PathJoinSubstitution(
        [FindPackageShare('ugv_acceptance'), 'launch', 'monitor.launch.py']
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'config',
                default_value='packbot',
                description='YAML file that describes the robot, or the name of one that ships',
            ),
            DeclareLaunchArgument(
                'namespace', default_value='', description='namespace of the robot'
            ),
            DeclareLaunchArgument('seed', default_value='1', description='of noise and faults'),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(monitor),
                launch_arguments={
                    'config': LaunchConfiguration('config'),
                    'namespace': LaunchConfiguration('namespace'),
                }.items(),
            ),
            Node(
                package='ugv_acceptance',
                executable='packbot_simulator',
                name='packbot_simulator',
                namespace=LaunchConfiguration('namespace'),
                output='screen',
                parameters=[
                    {
                        'config': ParameterValue(LaunchConfiguration('config'), value_type=str),
                        'seed': ParameterValue(LaunchConfiguration('seed'), value_type=int),
                    }
                ],
            ),
        ]
    )
