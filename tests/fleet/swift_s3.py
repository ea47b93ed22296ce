"""An S3 server for tests: OpenStack Swift of Debian's python3-swift with its S3 middleware, which
checks signatures by itself; all of it in one process, on one port, without memcached.

    swift_s3.py FOLDER ADDRESS PORT BUCKET

Prints "ready PORT" when it answers (PORT 0 takes a free one); exit status 77 where Swift is not
installed. The bucket is there from the start."""
import array
import os
import pathlib
import sys

KEY, SECRET = "test:tester", "testing"
PIPELINE = """
[DEFAULT]
swift_dir = {folder}
[pipeline:main]
pipeline = catch_errors gatekeeper s3api tempauth slo proxy-server
[app:proxy-server]
use = egg:swift#proxy
account_autocreate = true
node_timeout = 30
[filter:catch_errors]
use = egg:swift#catch_errors
[filter:gatekeeper]
use = egg:swift#gatekeeper
[filter:s3api]
use = egg:swift#s3api
[filter:tempauth]
use = egg:swift#tempauth
user_test_tester = testing .admin
[filter:slo]
use = egg:swift#slo
"""


class Memory:
    """What Swift keeps in memcached."""

    def __init__(self):
        self._values = {}

    def get(self, key, **_):
        return self._values.get(key)

    def set(self, key, value, **_):
        self._values[key] = value

    def delete(self, key, **_):
        self._values.pop(key, None)


def main():
    try:
        import eventlet
        eventlet.monkey_patch()
        from eventlet import wsgi
        from swift.account.server import AccountController
        from swift.common import swob, utils
        from swift.common.ring import RingData
        from swift.common.wsgi import loadapp
        from swift.container.server import ContainerController
        from swift.obj.server import ObjectController
    except ImportError as error:
        print(f"skipped: python3-swift is not installed ({error})")
        return 77

    folder = pathlib.Path(sys.argv[1])
    address, port, bucket = sys.argv[2], int(sys.argv[3]), sys.argv[4]
    silence = open(os.devnull, "w", encoding="ascii")
    (folder / "devices/sda1").mkdir(parents=True, exist_ok=True)
    (folder / "swift.conf").write_text("[swift-hash]\nswift_hash_path_suffix = rilievo\n",
                                       encoding="ascii")
    (folder / "proxy.conf").write_text(PIPELINE.format(folder=folder), encoding="ascii")
    utils.SWIFT_CONF_FILE = str(folder / "swift.conf")
    utils.validate_hash_conf()
    conf = {"swift_dir": str(folder), "devices": str(folder / "devices"), "mount_check": "false"}
    for name, controller in (("account", AccountController), ("container", ContainerController),
                             ("object", ObjectController)):
        listener = eventlet.listen(("127.0.0.1", 0))
        device = {"id": 0, "zone": 0, "region": 1, "device": "sda1", "ip": "127.0.0.1",
                  "port": listener.getsockname()[1], "weight": 1}
        RingData([array.array("H", [0] * 4)], [device], 30).save(str(folder / f"{name}.ring.gz"))
        eventlet.spawn(wsgi.server, listener, controller(dict(conf)), silence)
    pipeline, memory = loadapp(str(folder / "proxy.conf"), global_conf={}), Memory()

    def application(environ, start_response):
        environ["swift.cache"] = memory
        return pipeline(environ, start_response)

    made = swob.Request.blank(f"/v1/AUTH_test/{bucket}", environ={
        "REQUEST_METHOD": "PUT", "swift_owner": True, "swift.authorize_override": True,
        "swift.authorize": lambda request: None}).get_response(application)
    if made.status_int // 100 != 2:
        print(f"the bucket was not made: {made.status}")
        return 1
    listener = eventlet.listen((address, port))
    print("ready", listener.getsockname()[1], flush=True)
    wsgi.server(listener, application, silence)
    return 0


if __name__ == "__main__":
    sys.exit(main())
