"""What measured times depend on: the processor, its cores, the versions of what computes."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("sss-tools", "numpy", "scipy", "embreex", "mitsuba")


def machine(threads: int | None = None) -> dict[str, str]:
    """Names and values, in the order to print; packages that are missing are left out.

    threads  of the renderer; None: one a core
    """
    cpuinfo = Path("/proc/cpuinfo")
    names = [line for line in cpuinfo.read_text().splitlines() if "model name" in line] if cpuinfo.exists() else []
    processor = names[0].split(":")[1].strip() if names else platform.processor() or platform.machine()
    cores = os.cpu_count() or 1
    about = {
        "processor": processor,
        "cores": str(cores),
        "threads": str(threads or cores),
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
    }
    for package in PACKAGES:
        try:
            about[package] = version(package)
        except PackageNotFoundError:
            continue
    return about


def sentence(about: dict[str, str]) -> str:
    """The machine in a line of text."""
    known = {"processor", "cores", "threads", "system"}
    versions = ", ".join(f"{name} {value}" for name, value in about.items() if name not in known)
    return f"{about['processor']}, {about['cores']} cores, {about['threads']} threads, {about['system']}; {versions}"
