"""The machines of a fleet: network namespaces where this user may make them, else one machine."""
import os
import shutil
import socket
import subprocess

_BRIDGE = "rilievo-fleet"
_FREE_PORTS = set()


def _run(command):
    subprocess.run(command.split(), check=True, stdout=subprocess.DEVNULL)


class OneMachine:
    """All hosts are this one: nothing can be cut off."""

    def address(self, host):
        return "127.0.0.1"

    def command(self, host):
        return []

    def close(self):
        pass


class Namespaces:
    """Each host has a network of its own, on one bridge with this machine."""

    def __init__(self, hosts):
        self._hosts = {host: f"10.77.83.{number}" for number, host in enumerate(hosts, 1)}
        self.close()
        _run(f"ip link add {_BRIDGE} type bridge")
        _run(f"ip address add 10.77.83.254/24 dev {_BRIDGE}")
        _run(f"ip link set {_BRIDGE} up")
        for host, address in self._hosts.items():
            space, link = f"{_BRIDGE}-{host}", f"rf-{host}"
            _run(f"ip netns add {space}")
            _run(f"ip link add {link} type veth peer name eth0 netns {space}")
            _run(f"ip link set {link} master {_BRIDGE} up")
            _run(f"ip -n {space} address add {address}/24 dev eth0")
            _run(f"ip -n {space} link set eth0 up")
            _run(f"ip -n {space} link set lo up")

    @staticmethod
    def possible():
        if os.geteuid() != 0 or shutil.which("ip") is None:
            return False
        made = subprocess.run(["ip", "netns", "add", f"{_BRIDGE}-try"], stderr=subprocess.DEVNULL)
        if made.returncode == 0:
            _run(f"ip netns del {_BRIDGE}-try")
        return made.returncode == 0

    def address(self, host):
        return self._hosts[host]

    def command(self, host):
        return ["ip", "netns", "exec", f"{_BRIDGE}-{host}"]

    def cut(self, host):
        _run(f"ip link set rf-{host} down")

    def mend(self, host):
        _run(f"ip link set rf-{host} up")

    def close(self):
        for host in self._hosts:
            subprocess.run(["ip", "netns", "del", f"{_BRIDGE}-{host}"], stderr=subprocess.DEVNULL)
        subprocess.run(["ip", "link", "del", _BRIDGE], stderr=subprocess.DEVNULL)


def free_port():
    """Of this machine, which nobody else was given."""
    while True:
        with socket.socket() as trial:
            trial.bind(("127.0.0.1", 0))
            port = trial.getsockname()[1]
        if port not in _FREE_PORTS:
            _FREE_PORTS.add(port)
            return port
