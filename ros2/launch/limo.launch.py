"""Waymark with a LIMO (limo_base and its camera are started by their own launch files): can be taught by its services and is shown in RViz.

    ros2 launch waymark limo.launch.py anchor:=0 tag_size_m:=0.16
    ros2 service call /waymark/start_teach std_srvs/srv/Trigger
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("anchor", default_value="0", description="Tag that defines the map frame"),
        DeclareLaunchArgument("tag_size_m", default_value="0.16", description="Side of the tags' black squares"),
        DeclareLaunchArgument("folder", default_value="waymark_session", description="Where recordings and maps are written"),
        DeclareLaunchArgument("robot", default_value="ros2:limo", description="ros2: and the name or path of a profile"),
        DeclareLaunchArgument("robot_file", default_value="", description="Name of a robot file, or path of a file written by `waymark commission`; default: the robot of the profile"),
        DeclareLaunchArgument("driver", default_value="page", description="Driver of the lap: page (its address is printed), or a connected gamepad"),
        ExecuteProcess(
            cmd=["waymark", "run", "--robot", LaunchConfiguration("robot"), "--robot-file", LaunchConfiguration("robot_file"),
                 "--driver", LaunchConfiguration("driver"), "--view",
                 "--anchor", LaunchConfiguration("anchor"), "--tag-size-m", LaunchConfiguration("tag_size_m"),
                 "--publish-ros2", "--output", LaunchConfiguration("folder")],
            output="screen"),
        Node(package="rviz2", executable="rviz2",
             arguments=["-d", [FindPackageShare("waymark"), "/rviz/waymark.rviz"]]),
    ])
