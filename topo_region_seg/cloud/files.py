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
import numpy.typing as npt

from topo_region_seg.cloud.ply import read_vertices, write_vertices
from topo_region_seg.data import Cloud, LabelArray

if TYPE_CHECKING:
    from collections.abc import Callable

SUFFIXES = (".pcd", ".ply")
Columns = dict[str, npt.NDArray[Any]]


class CloudFileError(Exception):
    """A cloud file cannot be read or written; the message names the file, the reason and the mend in one line."""


def read_cloud(path: str | Path, *, max_points: int) -> Cloud:
    """Read a .pcd (ASCII, binary, compressed) or .ply file; organized PCD files keep their height and width.

    Raises
    ------
    CloudFileError
        The file is missing, damaged, of another kind, too large or has no x, y, z.
    """
    path = Path(path)
    read = _by_suffix(path, _read_pcd, _read_ply)
    try:
        columns, height, width = read(path)
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
    missing = [name for name in ("x", "y", "z") if name not in columns]
    if missing:
        raise CloudFileError(f"{path}: has no {', '.join(missing)}, only {', '.join(columns)}; give a cloud of points")
    n = len(columns["x"])
    if n > max_points:
        raise CloudFileError(
            f"{path}: {n} points are more than max_points allows ({max_points}); "
            "raise it with --set max_points, or --set over_max_points=thin"
        )
    if height * width != n:
        raise CloudFileError(f"{path}: holds {n} points, but claims {width} x {height}; the file is damaged")
    with np.errstate(over="ignore", invalid="ignore"):
        xyz = np.column_stack([columns[name] for name in ("x", "y", "z")]).astype(np.float32)
    return Cloud(np.ascontiguousarray(xyz), _color(columns), height, width)


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
    if type(error).__name__ == "ValidationError":  # pydantic's, many lines long
        return "its header is damaged"
    return " ".join(str(error).split())[:200] or type(error).__name__


def _read_pcd(path: Path) -> tuple[Columns, int, int]:
    from pypcd4 import PointCloud

    cloud = PointCloud.from_path(path)
    data = np.atleast_1d(cloud.pc_data)
    return {name: data[name] for name in data.dtype.names or ()}, cloud.metadata.height, cloud.metadata.width


def _read_ply(path: Path) -> tuple[Columns, int, int]:
    data = read_vertices(path)
    columns = {name: data[name] for name in data.dtype.names or ()}
    for channel, name in (("r", "red"), ("g", "green"), ("b", "blue")):
        for spelling in (name, f"diffuse_{name}"):
            if spelling in columns and columns[spelling].dtype == np.uint8:
                columns[channel] = columns[spelling]
    return columns, 1, len(data)


def _color(columns: Columns) -> npt.NDArray[np.uint8] | None:
    for packed in ("rgb", "rgba"):
        if packed in columns and columns[packed].dtype.itemsize == 4:
            # Blue, green, red, alpha in memory; bytes, as some of these are NaN when they are read as floats.
            quads = np.ascontiguousarray(columns[packed]).view(np.uint8).reshape(-1, 4)
            return np.ascontiguousarray(quads[:, 2::-1])
    if all(name in columns and columns[name].dtype == np.uint8 for name in "rgb"):
        return np.column_stack([columns[name] for name in "rgb"])
    return None


def _write_pcd(path: Path, cloud: Cloud, labels: LabelArray) -> None:
    from pypcd4 import Encoding, PointCloud

    columns = [*np.asarray(cloud.xyz, np.float32).T]
    fields, types = ["x", "y", "z"], [np.float32] * 3
    if cloud.rgb is not None:
        quads = np.zeros((len(cloud), 4), np.uint8)
        quads[:, :3] = cloud.rgb[:, ::-1]
        columns.append(quads.view("<f4")[:, 0])
        fields, types = [*fields, "rgb"], [*types, np.float32]
    out = PointCloud.from_points([*columns, labels], [*fields, "label"], [*types, np.uint32])
    out.metadata.height, out.metadata.width = cloud.height, cloud.width
    out.save(path, encoding=Encoding.BINARY_COMPRESSED if len(cloud) else Encoding.BINARY)


def _write_ply(path: Path, cloud: Cloud, labels: LabelArray) -> None:
    record = [("x", "f4"), ("y", "f4"), ("z", "f4")]
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
