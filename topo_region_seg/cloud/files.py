# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""PCD and PLY files <-> :class:`~topo_region_seg.data.Cloud`."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from topo_region_seg.cloud.file_colors import read_colors
from topo_region_seg.cloud.layout import COORDINATES, Warn, ignore
from topo_region_seg.cloud.pcd import read_pcd
from topo_region_seg.cloud.ply import read_vertices, write_vertices
from topo_region_seg.data import Cloud, LabelArray

if TYPE_CHECKING:
    from collections.abc import Callable

SUFFIXES = (".pcd", ".ply")


class CloudFileError(Exception):
    """A cloud file cannot be read or written; the message names the file, the reason and what to do, in one line."""


def read_cloud(
    path: str | Path, *, max_points: int, warn: Warn | None = None, advice: str = "raise it with --set max_points"
) -> Cloud:
    """Read a .pcd (ASCII, binary, compressed) or .ply file; organized PCD files keep their height and width.

    Parameters
    ----------
    path : str or Path
        The file.
    max_points : int
        Larger clouds are refused.
    warn : callable, optional
        Called with (code, text) for what is readable but odd.
    advice : str
        What the error says to do about a cloud that is too large.

    Returns
    -------
    Cloud
        Coordinates are float64 where the file has them so, else float32. The sensor's pose is a PCD file's VIEWPOINT.

    Raises
    ------
    CloudFileError
        The file is missing, damaged, of another kind, too large or has no x, y, z.
    """
    path = Path(path)
    read = _by_suffix(path, _read_pcd, _read_ply)

    def check_points(n: int) -> None:
        if n > max_points:
            raise CloudFileError(f"{path}: {n} points are more than max_points allows ({max_points}); {advice}")

    try:
        columns, height, width, pose, is_text, oddities = read(path, check_points)
    except CloudFileError:
        raise
    except FileNotFoundError:
        raise CloudFileError(f"{path}: no such file; check the name") from None
    except IsADirectoryError:
        raise CloudFileError(f"{path}: is a folder; give a .pcd or .ply file") from None
    except ImportError:
        raise  # not the file's fault: the package that reads it is missing
    except Exception as error:  # the libraries let every kind of error through
        reason = _reason(path, error)
        kind = path.suffix.lstrip(".").upper()
        raise CloudFileError(f"{path}: cannot be read as {kind} ({reason}); check or convert the file") from error
    warn = warn or ignore
    for oddity in oddities:
        warn("odd_file", f"{path}: {oddity}")
    columns = {**{name.lower(): column for name, column in columns.items()}, **columns}
    missing = [name for name in COORDINATES if name not in columns]
    if missing:
        raise CloudFileError(f"{path}: has no {', '.join(missing)}, only {', '.join(columns)}; give a cloud of points")
    n = len(columns["x"])
    if height * width != n:
        raise CloudFileError(f"{path}: holds {n} points, but claims {width} x {height}; the file is damaged")
    # Doubles, and whole numbers that float32 cannot hold, stay exact.
    xyz = np.column_stack([columns[name] for name in COORDINATES])
    xyz = np.ascontiguousarray(xyz.astype(np.result_type(xyz.dtype, np.float32)))
    rgb = read_colors(columns, np.isfinite(xyz).all(axis=1), is_text, warn)
    return Cloud(xyz, rgb, height, width, pose)


def write_labeled_cloud(path: str | Path, cloud: Cloud, labels: LabelArray) -> None:
    """Write the cloud with its colors and a field `label`, as .pcd or .ply; the file appears whole or not at all.

    Raises
    ------
    CloudFileError
        The suffix is of another kind, or nothing can be written there.
    """
    path = Path(path)
    write = _by_suffix(path, _write_pcd, _write_ply)
    temporary: str | None = None
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
        os.close(handle)
        write(Path(temporary), cloud, labels)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    except OSError as error:
        raise CloudFileError(f"{path}: cannot be written ({error.strerror}); choose another place") from error
    finally:
        if temporary is not None:
            with suppress(FileNotFoundError):
                os.unlink(temporary)


def check_output(path: str | Path) -> None:
    """Check before the work that :func:`write_labeled_cloud` will be able to write to `path`.

    Raises
    ------
    CloudFileError
        The suffix is of another kind, or nothing can be written there.
    ImportError
        The package that writes such files is missing.
    """
    path = Path(path)
    if _by_suffix(path, _write_pcd, _write_ply) is _write_pcd:
        import pypcd4  # noqa: F401
    if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise CloudFileError(f"{path}: the folder {path.parent} is missing or not writable; choose another place")


def _by_suffix(path: Path, pcd: Callable[..., Any], ply: Callable[..., Any]) -> Callable[..., Any]:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise CloudFileError(f"{path}: is neither .pcd nor .ply; convert it to one of them")
    return pcd if suffix == ".pcd" else ply


def _reason(path: Path, error: Exception) -> str:
    if path.stat().st_size == 0:
        return "the file is empty"
    return " ".join(str(error).split())[:200] or type(error).__name__


def _read_pcd(path: Path, check_points: Callable[[int], None]) -> tuple[Any, ...]:
    cloud = read_pcd(path, check_points)
    return cloud.columns, cloud.height, cloud.width, cloud.viewpoint, cloud.is_text, cloud.oddities


def _read_ply(path: Path, check_points: Callable[[int], None]) -> tuple[Any, ...]:
    data = read_vertices(path, check_points)
    return {name: data[name] for name in data.dtype.names or ()}, 1, len(data), None, False, ()


def _coordinate_type(cloud: Cloud) -> type[np.floating[Any]]:
    return np.float64 if cloud.xyz.dtype == np.float64 else np.float32


def _write_pcd(path: Path, cloud: Cloud, labels: LabelArray) -> None:
    from pypcd4 import Encoding, PointCloud

    kind = _coordinate_type(cloud)
    columns = [*np.asarray(cloud.xyz, kind).T]
    fields, types = [*COORDINATES], [kind] * 3
    if cloud.rgb is not None:
        quads = np.zeros((len(cloud), 4), np.uint8)
        quads[:, :3] = cloud.rgb[:, ::-1]
        columns.append(quads.view("<f4")[:, 0])
        fields, types = [*fields, "rgb"], [*types, np.float32]
    out = PointCloud.from_points([*columns, labels], [*fields, "label"], [*types, np.uint32])
    out.metadata.height, out.metadata.width = cloud.height, cloud.width
    if cloud.sensor_pose is not None:
        out.metadata.viewpoint = tuple(cloud.sensor_pose)
    out.save(path, encoding=Encoding.BINARY_COMPRESSED if len(cloud) else Encoding.BINARY)


def _write_ply(path: Path, cloud: Cloud, labels: LabelArray) -> None:
    record: list[tuple[str, Any]] = [(name, _coordinate_type(cloud)) for name in COORDINATES]
    if cloud.rgb is not None:
        record += [("red", "u1"), ("green", "u1"), ("blue", "u1")]
    table = np.empty(len(cloud), [*record, ("label", "u4")])
    for axis, name in enumerate("xyz"):
        table[name] = cloud.xyz[:, axis]
    if cloud.rgb is not None:
        for axis, name in enumerate(("red", "green", "blue")):
            table[name] = cloud.rgb[:, axis]
    table["label"] = labels
    write_vertices(path, table)
