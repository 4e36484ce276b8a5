"""A recording played into the monitor: `ros2 launch ugv_acceptance replay.launch.py bag:=run1`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the monitor and a player that publishes the recording on its own topics."""
    monitor = PathJoinSubstitution(
        [FindPackageShare('ugv_acceptance'), 'launch', 'monitor.launch.py']
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument('bag', description='recording: a rosbag2 folder or one file'),
            DeclareLaunchArgument(
                'config',
                default_value='packbot',
                description='YAML file that describes the robot, or the name of one that ships',
            ),
            DeclareLaunchArgument(
                'namespace', default_value='', description='namespace of the robot'
            ),
            DeclareLaunchArgument(
                'rate', default_value='1.0', description='speed, as a multiple of real time'
            ),
            DeclareLaunchArgument(
                'loop', default_value='false', description='start again at the end'
            ),
            DeclareLaunchArgument(
                'restamp',
                default_value='true',
                description='move header stamps to now: the monitor compares them with its clock',
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(monitor),
                launch_arguments={
                    'config': LaunchConfiguration('config'),
                    'namespace': LaunchConfiguration('namespace'),
                }.items(),
            ),
            Node(
                package='ugv_acceptance',
                executable='bag_player',
                name='bag_player',
                namespace=LaunchConfiguration('namespace'),
                output='screen',
                parameters=[
                    {
                        'bag': ParameterValue(LaunchConfiguration('bag'), value_type=str),
                        'rate': ParameterValue(LaunchConfiguration('rate'), value_type=float),
                        'loop': ParameterValue(LaunchConfiguration('loop'), value_type=bool),
                        'restamp': ParameterValue(LaunchConfiguration('restamp'), value_type=bool),
                    }
                ],
            ),
        ]
    )
