"""A node that makes a surface of each point cloud: of the topic /cloud, with ROS 2 or ROS 1, into
FOLDER/cloud_SECONDS_NANOSECONDS.dss; a file that is there already stays as it is.

    surface_of_cloud.py FOLDER [/topic]"""
import pathlib
import sys

import numpy as np
import rilievo

# sensor_msgs/PointField: datatype to NumPy.
TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def points_of(cloud):
    """The points of a sensor_msgs/PointCloud2 as a structured array (n,) with its fields; `rgb` and
    `rgba`, which hold three bytes in a float or an integer, as red, green and blue (uint8). In the
    frame and unit of the message, metres as a rule."""
    order = ">" if cloud.is_bigendian else "<"
    names, formats, offsets = [], [], []
    for field in cloud.fields:
        if field.datatype not in TYPES:
            raise ValueError(f"field {field.name}: datatype {field.datatype} is none of PointField's")
        count = max(field.count, 1)
        names.append(field.name)
        formats.append((order + TYPES[field.datatype], (count,)) if count > 1
                       else order + TYPES[field.datatype])
        offsets.append(field.offset)
        if field.name in ("rgb", "rgba"):
            names += ["red", "green", "blue"]
            formats += 3 * ["u1"]
            offsets += [field.offset + (byte if order == "<" else 3 - byte) for byte in (2, 1, 0)]
    record = np.dtype({"names": names, "formats": formats, "offsets": offsets,
                       "itemsize": cloud.point_step})
    rows = np.ndarray((cloud.height, cloud.width), record, bytes(cloud.data),
                      strides=(cloud.row_step, cloud.point_step))
    return rows.reshape(-1)


def write_surface(cloud, folder):
    """Its file, named by the time of the message. Points without a return are NaN in such messages;
    they are left out. FileExistsError where there is one of the same time already."""
    stamp = cloud.header.stamp
    seconds, nanoseconds = ((stamp.sec, stamp.nanosec) if hasattr(stamp, "sec")
                            else (stamp.secs, stamp.nsecs))
    path = pathlib.Path(folder) / f"cloud_{seconds}_{nanoseconds:09}.dss"
    if path.exists():
        raise FileExistsError(f"{path} is there already; give each run a folder of its own")
    points = points_of(cloud)
    surface = rilievo.reconstruct(points, unit="m", up="z")
    surface.write(path)
    return path


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    folder, topic = sys.argv[1], (sys.argv[2:] or ["/cloud"])[0]
    from sensor_msgs.msg import PointCloud2
    try:
        import rclpy
    except ImportError:
        import rospy
        rospy.init_node("surface_of_cloud")
        rospy.Subscriber(topic, PointCloud2, lambda cloud: print(write_surface(cloud, folder)),
                         queue_size=1)
        rospy.spin()
        return
    rclpy.init()
    node = rclpy.create_node("surface_of_cloud")
    node.create_subscription(PointCloud2, topic,
                             lambda cloud: print(write_surface(cloud, folder)), 1)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
