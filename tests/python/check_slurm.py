"""A wedge on a real Slurm of two nodes, both this machine: tasks are told to stop, killed and lose their node, and the
results are those of the same wedge without Slurm. Then a study, the same way.

Usage: check_slurm.py PROGRAM SOURCE_FOLDER. Needs root, and Debian's munge, slurmctld, slurmd and slurm-client, which it
installs where they are missing; exits with 77 where that cannot be. Whatever Slurm the machine has besides is left alone.
"""
import csv
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PACKAGES = ["munge", "slurmctld", "slurmd", "slurm-client"]
PROGRAM, SOURCE = sys.argv[1], Path(sys.argv[2])
PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol", "scancel"]
NODES = ["node1", "node2"]  # of a core each
TASKS = 8
DEADLINE = 180  # s for everything but installing
HOSTS = Path("/etc/hosts")

# data/scenes/notched_block.toml, coarse and short: a few seconds a run, most of them tear.
CHANGES = {"voxel_size = 0.05": "voxel_size = 0.1", "frames = [1, 96]": "frames = [1, 48]"}
WEDGE = """
[wedge]
about = "how fast a pull tears how tough a gel"

[[wedge.vary]]
key = "fracture.toughness"
values = [1000, 2000, 4000, 8000]

[[wedge.vary]]
key = "grip.top.move.velocity.1"
values = [0.1, 0.3]
"""
failures = []


def expect(name, holds):
    if not holds:
        failures.append(name)


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def wait_for(condition, what, seconds):
    """What becomes true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.05)
    raise TimeoutError(f"waited {seconds} s for {what}")


def missing():
    return [p for p in PROGRAMS if not shutil.which(p)]


def install():
    """The programs, or the end of the test."""
    if os.geteuid() != 0:
        skip("a Slurm of one's own needs root")
    if not missing():
        return
    if not shutil.which("apt-get"):
        skip(f"no {', '.join(missing())}, and no apt-get to install them with")
    said = ""
    for command in ["install"], ["update"], ["install"]:  # lists of packages may be missing or old
        more = ["-y", "--no-install-recommends", *PACKAGES] if command == ["install"] else []
        try:
            run = subprocess.run(["apt-get", *command, *more], env={**os.environ, "DEBIAN_FRONTEND": "noninteractive"},
                                 stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120)
            said = run.stdout + run.stderr
        except subprocess.TimeoutExpired:
            said = "apt-get took more than two minutes"
        if not missing():
            print(f"installed {', '.join(PACKAGES)}")
            return
    skip(f"no {', '.join(missing())}, and they cannot be installed:\n{said[-1000:]}")


def free_ports(count):
    """Ports that nobody listens on just now."""
    sockets = [socket.socket() for _ in range(count)]
    for s in sockets:
        s.bind(("127.0.0.1", 0))
    ports = [s.getsockname()[1] for s in sockets]
    for s in sockets:
        s.close()
    return ports


class HostName:
    """This machine's name, which the daemons look up: in /etc/hosts while it is needed, where it was not."""

    def __enter__(self):
        self.name, self.before = socket.gethostname().split(".")[0], None
        try:
            socket.gethostbyname(self.name)
        except OSError:
            self.before = HOSTS.read_bytes() if HOSTS.exists() else b""
            HOSTS.write_bytes(self.before + f"\n127.0.0.1 {self.name}\n".encode())  # in place: it may be a mount
            print(f"{HOSTS}: {self.name} added, until the test ends")
        return self.name

    def __exit__(self, *_):
        if self.before is not None:
            HOSTS.write_bytes(self.before)


class Cluster:
    """munged, slurmctld and a slurmd for each node, with all that they keep in a folder."""

    def __init__(self, folder, host):
        folder.mkdir()
        self.folder, self.daemons = folder, []
        self.conf = folder / "slurm.conf"
        self.environment = {**{k: v for k, v in os.environ.items() if not k.startswith(("SLURM_", "SBATCH_"))}, "SLURM_CONF": str(self.conf)}
        self.socket = folder / "munge.socket"
        key = folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        for name in "state", *NODES:
            (folder / name).mkdir()
        (folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")  # read, even if nothing asks for a cgroup
        self.conf.write_text(self.settings(host))

    def settings(self, host):
        ports = free_ports(1 + len(NODES))
        # A task that is queued again waits until its credential has expired: two minutes, and no less than 5 s. Jobs are looked at every second instead of every minute. Nothing needs cgroups, which containers have not.
        lines = f"""
            ClusterName=test
            SlurmctldHost={host}(127.0.0.1)
            SlurmctldPort={ports[0]}
            SlurmUser=root
            AuthType=auth/munge
            CredType=cred/munge
            AuthInfo=socket={self.socket},cred_expire=5
            StateSaveLocation={self.folder}/state
            SlurmdSpoolDir={self.folder}/%n
            SlurmctldPidFile={self.folder}/slurmctld.pid
            SlurmdPidFile={self.folder}/slurmd.%n.pid
            SlurmctldLogFile={self.folder}/slurmctld.log
            SlurmdLogFile={self.folder}/slurmd.%n.log
            ProctrackType=proctrack/linuxproc
            TaskPlugin=task/none
            JobAcctGatherType=jobacct_gather/none
            AccountingStorageType=accounting_storage/none
            MpiDefault=none
            SwitchType=switch/none
            PlugStackConfig={self.folder}/plugstack.conf
            SelectType=select/cons_tres
            SelectTypeParameters=CR_CPU_Memory
            SchedulerType=sched/builtin
            SchedulerParameters=sched_interval=1,sched_min_interval=0,batch_sched_delay=0
            SlurmdParameters=config_overrides
            JobRequeue=1
            MinJobAge=600
            KillWait=10
            ReturnToService=2
            PartitionName=all Nodes={','.join(NODES)} Default=YES MaxTime=INFINITE State=UP
        """
        nodes = [f"NodeName={n} NodeHostname={host} NodeAddr=127.0.0.1 Port={p} CPUs=1 RealMemory=4000 State=UNKNOWN"
                 for n, p in zip(NODES, ports[1:])]
        return "\n".join([line.strip() for line in lines.splitlines()] + nodes) + "\n"

    def __enter__(self):
        try:
            munged = [f"--{k}={self.folder / v}" for k, v in (("key-file", "munge.key"), ("socket", "munge.socket"),
                      ("pid-file", "munged.pid"), ("log-file", "munged.log"), ("seed-file", "munged.seed"))]
            self.start(["munged", "--foreground", "--force", *munged])
            wait_for(self.socket.exists, "munged", 10)
            (self.folder / "plugstack.conf").touch()
            self.start(["slurmctld", "-D", "-f", self.conf])
            for node in NODES:
                self.start(["slurmd", "-D", "-N", node, "-f", self.conf])
            wait_for(lambda: self.ask("sinfo", "-h", "-o", "%t %D").strip() == f"idle {len(NODES)}", "idle nodes", 30)
        except BaseException:
            self.__exit__(*sys.exc_info())
            raise
        return self

    def start(self, command):
        with open(self.folder / f"{command[0]}.{len(self.daemons)}.out", "wb") as log:
            self.daemons.append(subprocess.Popen([*map(str, command)], env=self.environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True))

    def run(self, *command):
        return subprocess.run([*map(str, command)], env=self.environment, capture_output=True, text=True, timeout=DEADLINE)

    def ask(self, *command):
        said = self.run(*command)
        if said.returncode != 0:
            print(f"{' '.join(map(str, command))}: exit {said.returncode}: {said.stderr}")
        return said.stdout

    def own_processes(self, *more):
        """All that was started here, jobs too: by the configuration in their environment."""
        marks = f"SLURM_CONF={self.conf}\0".encode(), *more
        found = []
        for environ in Path("/proc").glob("[0-9]*/environ"):
            try:
                text = environ.read_bytes() + b"\0"
                if all(mark in text for mark in marks):
                    found.append(int(environ.parent.name))
            except OSError:
                pass  # has ended
        return found

    def __exit__(self, kind, *_):
        if kind or failures:
            self.say_logs()
        signal.alarm(0)  # this has to come to its end
        for daemon in reversed(self.daemons):  # munged last: the others wait for it
            daemon.terminate()
            try:
                daemon.wait(timeout=5)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        for process in self.own_processes():  # of jobs
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass
        wait_for(lambda: not self.own_processes(), "the processes of jobs to end", 10)

    def say_logs(self):
        # What the daemons said before they had logs is in .out; the logs of tasks lie beside this folder.
        for lines, names in (25, "cluster/*.log"), (5, "cluster/*.out"), (5, "wedge/logs/*.log"):
            for log in sorted(self.folder.parent.glob(names)):
                print(f"---- {log.name}\n" + "\n".join(log.read_text(errors="replace").splitlines()[-lines:]))


class Tasks:
    """An array job of a wedge."""

    def __init__(self, cluster, wedge, job):
        self.cluster, self.wedge, self.job = cluster, wedge, job

    def records(self):
        """What Slurm knows of each job and task."""
        lines = self.cluster.ask("scontrol", "-o", "show", "job").splitlines()
        return [dict(re.findall(r"(\S+?)=(\S*)", line)) for line in lines if line.startswith("JobId=")]

    def record(self, task):
        found = [r for r in self.records() if r.get("ArrayJobId") == self.job and r["ArrayTaskId"] == str(task)]
        return found[0] if found else {"JobState": "PENDING"}  # one of "2-7", which wait together

    def when(self, task, *states):
        """Its record, once it is in one of the states."""
        def reached():
            record = self.record(task)
            return record if record["JobState"] in states else None
        return wait_for(reached, f"task {task} to be {' or '.join(states)}", 60)

    def well_begun(self, task):
        """Its record, once it runs and has written frames and checkpoints."""
        record = self.when(task, "RUNNING")
        run = self.wedge / f"{task:04}"
        wait_for(lambda: len(list(run.glob("obj/*.obj"))) > 5 and list(run.glob("ckpt/*.ckpt")), f"frames of task {task}", 30)
        return record

    def log(self, task):
        return (self.wedge / f"logs/{task}.slurm.log").read_text()

    def simulation(self, task):
        """The process that simulates, below the one that Slurm started."""
        marks = f"SLURM_ARRAY_JOB_ID={self.job}\0".encode(), f"SLURM_ARRAY_TASK_ID={task}\0".encode()
        return [p for p in self.cluster.own_processes(*marks) if Path(f"/proc/{p}/cmdline").read_bytes().split(b"\0")[1:2] == [b"sim"]]

    def tell(self, task):
        """SIGUSR1 for a task, as Slurm sends it. Of an array's task scancel believes that it was not to be had, and would
        say it again and again."""
        record = self.well_begun(task)
        scancel = subprocess.Popen(["scancel", "--batch", "--signal=USR1", record["JobId"]], env=self.cluster.environment, stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: "stopped by SIGUSR1" in self.log(task), f"task {task} to stop", 20)
        finally:
            scancel.kill()
            scancel.wait()

    def interrupt(self):
        """Task 0 is told to stop, as before its time is over; task 1 dies, as of too much memory; task 2 loses its node."""
        ask = self.cluster.ask
        self.well_begun(1)
        for process in self.simulation(1):  # at once: tasks take some seconds
            os.kill(process, signal.SIGKILL)
        self.tell(0)
        self.when(1, "FAILED")
        ask("scontrol", "requeue", f"{self.job}_1")
        node = self.well_begun(2)["NodeList"]
        ask("scontrol", "update", f"NodeName={node}", "State=DOWN", "Reason=test")  # which answers, and so is taken in again
        return 0, 1, 2

    def have_ended(self):
        return all(r["JobState"] in ("COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL", "OUT_OF_MEMORY") for r in self.records())


def on_slurm(cluster, scene, wedge):
    said = cluster.run(PROGRAM, "wedge", scene, "--slurm", "-o", wedge, "--time", "10m", "--sim=--checkpoint-every=1")
    job = re.match(r"job (\d+): 8 tasks", said.stdout)
    if not job:
        failures.append(f"no job: exit {said.returncode}\n{said.stdout}{said.stderr}")
        return
    again = cluster.run(PROGRAM, "wedge", scene, "--slurm", "-o", wedge, "--time", "10m")
    expect(f"handed in twice: {again.stderr}", again.returncode == 2 and f"job {job[1]} for it is queued" in again.stderr)
    tasks = Tasks(cluster, wedge, job[1])
    interrupted = tasks.interrupt()
    wait_for(tasks.have_ended, "all to end", 90)
    for task in range(TASKS):
        record, log = tasks.record(task), tasks.log(task)
        restarts = int(task in interrupted)
        state = [record[k] for k in ("JobState", "ExitCode", "Restarts")]
        resumed = log.count("resumes after step")
        if state != ["COMPLETED", "0:0", str(restarts)] or resumed != restarts:
            failures.append(f"task {task}: {state}, resumed {resumed} times (expected {restarts}); its log:\n{log}")
        asked = {k: record.get(k) for k in ("TimeLimit", "MinMemoryNode", "CPUs/Task")}
        expect(f"task {task} asks for {asked}", asked["TimeLimit"] == "00:10:00" and re.fullmatch(r"[1-9]\d+M", asked["MinMemoryNode"]) and asked["CPUs/Task"] == "1")
    expect("task 2 does not say that its node failed", "NODE FAILURE" in tasks.log(2))
    (last,) = [r for r in tasks.records() if "ArrayJobId" not in r]
    expect(f"the job that collects: {last}", last["JobState"] == "COMPLETED")
    script = (wedge / "array.sh").read_text()
    for line in "#SBATCH --mem=", "#SBATCH --time=00:10:00", "#SBATCH --array=0-7", "#SBATCH --signal=B:USR1@60", "#SBATCH --requeue":
        expect(f"array.sh has no {line}:\n{script}", line in script)


def study_on_slurm(cluster, top):
    """Runs as tasks, and the study when they have ended: values as without Slurm, and none is made again."""
    scene, there, here = SOURCE / "data/scenes/studies/bar.toml", top / "study", top / "study_here"
    command = [PROGRAM, "study", scene, "--vary", "time.substeps=2,4,8", "--rounds", "0"]
    said = cluster.run(*command, "--slurm", "-o", there)
    job = re.match(r"job (\d+): (\d+) tasks", said.stdout)
    if not job:
        failures.append(f"no job of the study: exit {said.returncode}\n{said.stdout}{said.stderr}")
        return
    wait_for(Tasks(cluster, there, job[1]).have_ended, "the study to end", 60)
    script = (there / "array.sh").read_text()
    expect(f"the study's array.sh:\n{script}", re.search(r"--array=0-2\n.*--mem=\d+M\n.*--time=00:1\d:\d\d\n", script, re.S))
    last = (there / "afterwards.sh").read_text()
    expect(f"the study's afterwards.sh:\n{last}", re.search(r"--cpus-per-task=1\n.*--mem=\d+M\n.*--time=\d\d:\d\d:\d\d\n", last, re.S))
    expect("the study reads the scene as it was", str(there / "study.scene.toml") in script)
    run = cluster.run(*command, "-o", here)
    expect(f"study: exit {run.returncode}\n{run.stdout}{run.stderr}", run.returncode == 0)
    log = (there / "logs/afterwards.slurm.log").read_text()
    expect(f"the runs of tasks are not used:\n{log}", re.search(r"3 of 3 runs reused", log))
    values = [[{k: v for k, v in row.items() if k in ("substeps", "time.substeps", "tip", "stress", "state_hash")} for row in csv.DictReader((f / "study.csv").open(newline=""))] for f in (there, here)]
    expect(f"study.csv: {values[0]}, without Slurm {values[1]}", values[0] == values[1] and len(values[0]) == 3 and values[0][0])


def frames(folder):
    """State, and bytes of the surface, of each frame of a run."""
    run = json.loads((folder / "run.json").read_text())
    return run["status"], [(f["frame"], f["state_hash"], [w["xxh3"] for w in f["files"] if w["path"].endswith(".obj")]) for f in run["frames"]]


def rows(wedge):
    """table.csv without seconds, which no two runs share."""
    with open(wedge / "table.csv", newline="") as file:
        return [{k: v for k, v in row.items() if "[s]" not in k} for row in csv.DictReader(file)]


def compare(wedge, other):
    for task in range(TASKS):
        (status, mine), (expected, others) = (frames(w / f"{task:04}") for w in (wedge, other))
        expect(f"run {task} is {status}, without Slurm {expected}", status == expected == "done")
        expect(f"run {task} has {len(mine)} frames", len(mine) == len(others) == 48)
        expect(f"run {task}: other frames than without Slurm, from {[m[0] for m, o in zip(mine, others) if m != o][:1]}", mine == others)
    expect("nothing tore", any(int(float(row["Fragments"])) > 1 for row in rows(other)))
    expect(f"table.csv: {rows(wedge)}\nwithout Slurm {rows(other)}", rows(wedge) == rows(other) and len(rows(wedge)) == TASKS)
    for folder in wedge, other:
        expect(f"{folder}: no page", "<html" in (folder / "report.html").read_text()[:1000].lower())
        expect(f"{folder}: no contact sheet", (folder / "contact_sheet.png").read_bytes().startswith(b"\x89PNG"))
    expect("partial files are left", not list(wedge.rglob(".partial*")))


def end(heard, _):
    raise TimeoutError(f"not done within {DEADLINE} s" if heard == signal.SIGALRM else signal.strsignal(heard))


def main():
    install()
    began = time.monotonic()
    for heard in signal.SIGALRM, signal.SIGTERM:  # so that the daemons end too
        signal.signal(heard, end)
    signal.alarm(DEADLINE)
    with tempfile.TemporaryDirectory(prefix="slurm_") as temporary, HostName() as host:
        top = Path(temporary)
        top.chmod(0o755)
        text = (SOURCE / "data/scenes/notched_block.toml").read_text()
        for before, now in CHANGES.items():
            expect(f"the scene has no {before}", before in text)
            text = text.replace(before, now)
        scene, wedge, other = top / "scene.toml", top / 'a "100%" wedge', top / "other"
        scene.write_text(text + WEDGE)
        with Cluster(top / "cluster", host) as cluster:
            on_slurm(cluster, scene, wedge)
            print(f"on Slurm: {time.monotonic() - began:.0f} s")
            run = cluster.run(PROGRAM, "wedge", scene, "--local", "-j", "2", "-o", other)
            expect(f"without Slurm: exit {run.returncode}\n{run.stdout}{run.stderr}", run.returncode == 0)
            if not failures:
                compare(wedge, other)
            study_on_slurm(cluster, top)
    print(f"in all: {time.monotonic() - began:.0f} s")


main()
print("\n".join(failures))
sys.exit(bool(failures))
