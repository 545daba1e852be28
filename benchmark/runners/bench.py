"""`python -m benchmark.runners.bench [--check | --commit]`: how fast it is, beside others, in one run.

Contenders of a group are called in turn; each round gives the processor time of each, and its ratio to the first of
the group in the same round, so that ratios hold on a machine that others use, too. Medians over rounds are reported.
`--check` ends with 1 where a ratio is worse by more than 25 % than the one committed in ``bench.json`` beside this
file; `--commit` writes that.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np

from benchmark.runners import bench_order
from benchmark.runners.bench_rows import GROUPS, SAMPLES, Group
from ins_eval.files import write_whole
from ins_eval.report.content import Block, Number, Paragraph, Picture, Section, Table, at_a_glance
from ins_eval.report.json_file import as_json
from ins_eval.report.page import write_page
from ins_eval.wording import significant

COMMITTED = Path(__file__).with_suffix(".json")
WORSE = 1.25
ROUNDS = 9
PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "python-ins")


def seconds() -> float:
    """Processor time of this process and of its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def measured(group: Group, rounds: int) -> dict[str, dict[str, float]]:
    """Median cost of each contender in the unit of the group, and the median of its speed over that of the first."""
    for run in group.contenders.values():
        run()
    cost: dict[str, list[float]] = {name: [] for name in group.contenders}
    for _ in range(rounds):
        for name, run in group.contenders.items():
            begin = seconds()
            run()
            cost[name].append((seconds() - begin) * 1e9 / group.amounts[name])
    first = np.array(next(iter(cost.values())))
    return {
        name: {"cost": float(np.median(each)), "ratio": float(np.median(first / np.array(each)))}
        for name, each in cost.items()
    }


def machine() -> dict[str, str]:
    """Where it ran, and with what."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True) if lines else None
    return {
        "processor": f"{model}, {os.cpu_count()} cores",
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "cc": compiler.stdout.splitlines()[0] if compiler and compiler.stdout else "none",
        **{name: version(name) for name in PACKAGES},
    }


def peak_memory() -> dict[str, float]:
    """Largest resident memory, MB, of a process that holds and navigates so many samples, every 25th step kept."""
    code = (
        "import sys, numpy as np; from ins_eval import navigate; from ins_eval.recording import Start;"
        "n = int(sys.argv[1]); still = np.full((n, 3), 1e-9);"
        "navigate(np.arange(1.0, n + 1) / 100.0, still, still, Start(0.0, 0.5, 0.0, 0.0, attitude_rad=(0.0,) * 3),"
        " vertical='frozen', every=25);"
        "print(next(line.split()[1] for line in open('/proc/self/status') if line.startswith('VmHWM')))"
    )
    if not Path("/proc/self/status").exists():
        return {}
    return {
        f"{size} samples": float(subprocess.check_output([sys.executable, "-c", code, str(size)], text=True)) / 1024.0
        for size in (1_000, SAMPLES, 4 * SAMPLES)
    }


def worsened(found: dict, committed: dict) -> list[str]:
    """A sentence for each ratio that is worse than the committed one by more than 25 %, or is gone."""
    said = []
    for group, rows in committed.items():
        for name, ratio in rows.items():
            now = found.get(group, {}).get("rows", {}).get(name)
            if now is None and name not in found.get(group, {}).get("missing", {}):
                said.append(f"{group}: {name} is not there any more")
            elif now is not None and now["ratio"] * WORSE < ratio:
                said.append(f"{group}: {name} has ratio {now['ratio']:.3g}, committed is {ratio:.3g}")
    return said


def sections(result: dict) -> list[Section]:
    """The page of a result."""
    kernel = result["groups"]["kernel"]["rows"]
    numbers = [
        Number(name, f"{significant(kernel[name]['ratio'])} times", f"as fast as {next(iter(kernel))}")
        for name in ("kernel", "public call", "python-ins")
        if name in kernel
    ]
    step = "make bench-check fails where a ratio is worse by more than 25 % than the committed one."
    order = Picture("order", bench_order.CAPTION)
    made = [
        at_a_glance(numbers, order, step),
        Section("Machine", [Table("Versions", ("what", ""), [*result["machine"].items()], align="ll")]),
    ]
    for group in result["groups"].values():
        rows = [
            (name, significant(one["cost"] / (1e9 if group["unit"] == "s" else 1.0)), significant(one["ratio"]))
            for name, one in group["rows"].items()
        ]
        blocks: list[Block] = [
            Table(group["title"], ("contender", group["unit"], "speed, the first is 1"), rows),
            *(Paragraph(reason, name) for name, reason in group["missing"].items()),
        ]
        made.append(Section(group["title"], blocks))
    memory = [(name, f"{mb:.0f}") for name, mb in result["peak_memory_mb"].items()]
    made.append(Section("Memory", [Table("Largest resident memory of a process", ("navigated", "MB"), memory)]))
    return made


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="bench", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("reports/bench"))
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--check", action="store_true", help="fail where a ratio is worse than the committed one")
    parser.add_argument("--commit", action="store_true", help="write the ratios that later runs are held against")
    asked = parser.parse_args(arguments)
    groups = {}
    for key, make in GROUPS.items():
        print(f"bench: {key}", file=sys.stderr, flush=True)
        group = make()
        rounds = max(3, asked.rounds // 3) if group.unit == "s" else asked.rounds
        groups[key] = {"title": group.title, "unit": group.unit, "missing": dict(group.missing)}
        groups[key]["rows"] = measured(group, rounds)
    orders = bench_order.errors()
    result = {"machine": machine(), "groups": groups, "peak_memory_mb": peak_memory(), "order": orders}
    kernel = groups["kernel"]["rows"]
    first = next(iter(kernel))
    answer = (
        f"The kernel is {kernel['kernel']['ratio']:.2f} times as fast as {first}, the public call "
        f"{kernel['public call']['ratio']:.2f} times, python-ins {kernel['python-ins']['ratio']:.3f} times."
    )
    write_page(
        asked.output, title="How fast it is", answer=answer, sections=sections(result),
        figures={"order": bench_order.figure(orders)}, metrics=result,
    )  # fmt: skip
    write_whole(asked.output / "bench.json", as_json(result))
    print(answer)
    ratios = {
        key: {name: round(one["ratio"], 4) for name, one in group["rows"].items()} for key, group in groups.items()
    }
    if asked.commit:
        write_whole(COMMITTED, (json.dumps(ratios, indent=1) + "\n").encode())
    if not asked.check:
        return 0
    said = worsened(groups, json.loads(COMMITTED.read_text()))
    print("\n".join(said) or "bench: no ratio is worse than the committed one by more than 25 %")
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())
