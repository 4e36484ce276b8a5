"""A simulated robot and its monitor: `ros2 launch ugv_acceptance simulator.launch.py`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def ours(name: str) -> PythonLaunchDescriptionSource:
    """Return another launch file of this package."""
    share = FindPackageShare('ugv_acceptance')
    return PythonLaunchDescriptionSource(PathJoinSubstitution([share, 'launch', name]))


def generate_launch_description() -> LaunchDescription:
    """Return the simulated robot, obeying cmd_vel and trajectories, its monitor and console."""
    robot = {
        'config': LaunchConfiguration('config'),
        'namespace': LaunchConfiguration('namespace'),
    }
    watched = {**robot, 'params_file': LaunchConfiguration('params_file')}
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
            DeclareLaunchArgument(
                'console', default_value='true', description='serve the operator page as well'
            ),
            DeclareLaunchArgument(
                'params_file',
                default_value='',
                description='YAML file of parameters of the monitor; config counts before it',
            ),
            IncludeLaunchDescription(ours('monitor.launch.py'), launch_arguments=watched.items()),
            IncludeLaunchDescription(
                ours('console.launch.py'),
                launch_arguments=robot.items(),
                condition=IfCondition(LaunchConfiguration('console')),
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
