"""Machines for tests: each a Debian with its own systemd in namespaces (scripts/machine), and cables between them."""

import contextlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
LACKING = 77
CAP_SYS_RESOURCE = 1 << 24
# What the machines have.
PACKAGES = ("systemd", "systemd-sysv", "dbus", "sudo", "openssh-server", "openssh-client")


class Lacking(Exception):
    """What the test needs is not here."""


def make_root(tar):
    """A Debian like the one here, with systemd and what an administrator comes in by, and nothing else."""
    release = dict(
        line.rstrip().split("=", 1) for line in open("/etc/os-release") if "=" in line
    )
    if "debian" not in release.get("ID", ""):
        raise Lacking("a Debian, of which another can be made")
    if not shutil.which("mmdebstrap"):
        raise Lacking("mmdebstrap (apt install mmdebstrap)")
    tar.parent.mkdir(parents=True, exist_ok=True)
    sources = pathlib.Path("/etc/apt/sources.list.d/debian.sources")
    command = ["mmdebstrap", "--quiet", "--variant=minbase", f"--include={','.join(PACKAGES)}", "--skip=output/dev"]
    command += [release["VERSION_CODENAME"], f"{tar}.unfinished.tar"] + [str(sources)] * sources.exists()
    made = subprocess.run(command, capture_output=True, text=True)
    if made.returncode != 0:
        raise Lacking("packages of a Debian: " + made.stderr.strip()[-300:])
    os.rename(f"{tar}.unfinished.tar", tar)


def root_tar():
    """Of which machines are made; it is made once."""
    given = os.environ.get("MIKOSHI_ROOT_TAR")
    tar = pathlib.Path(given or HERE.parent / "target/machine-root.tar")
    if not tar.exists():
        make_root(tar)
    return tar


def as_root():
    """Whoever may be root goes on as root."""
    if os.geteuid() != 0 and shutil.which("sudo"):
        os.execvp("sudo", ["sudo", "--non-interactive", "--preserve-env=MIKOSHI_ROOT_TAR", *sys.argv])


class Machine:
    """A machine of this name."""

    def __init__(self, tar, name="machine"):
        self.name = name
        self.process = subprocess.Popen(
            [HERE / "machine", tar, name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        word = self.process.stdout.readline().split()
        if not word:
            status = self.process.wait()
            raise Lacking("a machine (see above)") if status == LACKING else SystemExit("the machine did not start")
        self.init = int(word[1])

    def end(self):
        self.process.stdin.close()
        self.process.wait()

    def path(self, path):
        return pathlib.Path(f"/proc/{self.init}/root{path}")

    def run(self, *command, check=True, user=None):
        enter = ["nsenter", "--target", str(self.init), "--all", "env", "-i", "PATH=/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"]
        if user is not None:
            enter += ["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups"]
        done = subprocess.run(enter + [str(word) for word in command], capture_output=True, text=True)
        if check and done.returncode != 0:
            raise AssertionError(f"{command}: {done.returncode}\n{done.stdout}{done.stderr}")
        return done

    def out(self, *command):
        return self.run(*command).stdout.strip()

    def can_raise_limits(self):
        """Whether units are granted what they say by LimitRTPRIO= and LimitMEMLOCK=."""
        capabilities = re.search(r"CapEff:\s+(\w+)", self.path("/proc/1/status").read_text()).group(1)
        return bool(int(capabilities, 16) & CAP_SYS_RESOURCE)

    def grant_rights(self):
        """What limits can't grant, capabilities do."""
        rights = "CAP_SYS_NICE CAP_IPC_LOCK"
        folder = self.path("/run/systemd/system/mikoshi-.service.d")
        folder.mkdir(parents=True, exist_ok=True)
        text = f"[Service]\nCapabilityBoundingSet={rights}\nAmbientCapabilities={rights}\n"
        (folder / "60-test.conf").write_text(text)

    def show(self, unit, *keys):
        text = self.out("systemctl", "show", unit, *[f"--property={key}" for key in keys])
        values = dict(line.split("=", 1) for line in text.splitlines())
        return values[keys[0]] if len(keys) == 1 else [values[key] for key in keys]

    def files(self):
        """All that is on it, but for what any machine writes by itself."""
        text = self.out("find", "/", "/dev/shm", "-xdev", "-not", "-path", "/var/log/*", "-not", "-path", "/var/cache/*")
        passing = re.compile(r"/(run|tmp|var/tmp|proc|sys)(/|$)|/var/lib/(dpkg|systemd|apt)/|/etc/.*-$|/etc/\.")
        return {path for path in text.splitlines() if not passing.match(path)}

    def host_pid(self, pid):
        """Of a process that has this one there: the one that it has here."""
        namespace = os.stat(f"/proc/{self.init}/ns/pid").st_ino
        for entry in pathlib.Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                if entry.name.isdigit() and os.stat(entry / "ns/pid").st_ino == namespace:
                    status = (entry / "status").read_text()
                    if re.search(r"^NSpid:.*\t(\d+)$", status, re.M).group(1) == str(pid):
                        return int(entry.name)
        raise AssertionError(f"no process has the id {pid}")


class Switch:
    """The network that machines are at: what one of them sends the others hear."""

    def __init__(self):
        script = "ip link add bridge type bridge && ip link set bridge up && echo up && exec cat"
        self.process = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        if self.process.stdout.readline() != "up\n":
            raise Lacking("a network of its own (iproute2, bridges): " + self.process.stderr.read().strip())
        self.ports = 0

    def connect(self, machine, address):
        """Gives a machine a cable, and this address of 24 bits."""
        port, self.ports = f"port{self.ports}", self.ports + 1
        here, there = str(self.process.pid), str(machine.init)
        ends = ["ip", "link", "add", port, "netns", here, "type", "veth", "peer", "name", "eth0", "netns", there]
        subprocess.run(ends, check=True)
        enter = ["nsenter", "--net", "--target"]
        subprocess.run([*enter, here, "ip", "link", "set", port, "master", "bridge", "up"], check=True)
        subprocess.run([*enter, there, "ip", "address", "add", f"{address}/24", "dev", "eth0"], check=True)
        subprocess.run([*enter, there, "ip", "link", "set", "eth0", "up"], check=True)

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def until(condition, what, patience_s=30.0):
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError(f"not within {patience_s:g} s: {what}")
