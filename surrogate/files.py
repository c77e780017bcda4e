"""Trained surrogates on disk, as plain arrays (no pickles): reading one cannot run anything."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.data.storage.files import whole_file
from birdstrike.surrogate.emulator import CurveEmulator, Emulator, jointly
from birdstrike.surrogate.features import Region
from birdstrike.surrogate.gaussian_process import kernel_of
from birdstrike.surrogate.inverse_network import InverseNetwork
from birdstrike.surrogate.network import Shape
from birdstrike.surrogate.scaling import OutputScaling, Scaling


def _save(path: Path, **arrays: Any) -> None:
    """An npz that is whole or absent."""
    with whole_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **arrays)


def save_network(path: Path, network: InverseNetwork) -> None:
    """One npz: weights, sizes, scalings, and what each input and output is."""
    shape = network.shape
    times: dict[str, Any] = {f"times_{i}": t for i, t in enumerate(network.times.values())}
    _save(
        path,
        names=network.names,
        weights=network.weights,
        shape=[shape.inputs, shape.hidden, shape.outputs],
        input_scaling=[network.inputs.low, network.inputs.high],
        output_scaling=[network.outputs.lows, network.outputs.highs],
        output_scales=np.array(network.outputs.scales, dtype=str),
        channels=list(network.times),
        bounded=network.outputs.bounded,
        **times,
    )


def load_network(path: Path) -> InverseNetwork:
    """What `save_network` wrote."""
    with np.load(path) as file:
        times = {str(channel): file[f"times_{i}"] for i, channel in enumerate(file["channels"])}
        bounded = "bounded" in file and bool(file["bounded"])  # older files hold linear outputs
        scales = tuple(map(str, file["output_scales"])) if "output_scales" in file else ()  # older files: linear ranges
        inputs = Scaling(*file["input_scaling"])
        outputs = OutputScaling(*file["output_scaling"], scales=scales, bounded=bounded)
        shape = Shape(*(int(size) for size in file["shape"]))
        return InverseNetwork(tuple(map(str, file["names"])), times, shape, file["weights"], inputs, outputs)


def save_emulator(path: Path, emulator: Emulator, dataset: Dataset) -> None:
    """One npz: the runs learnt from and the fitted hyperparameters; the rest follows from them."""
    used = np.isin(dataset.runs, emulator.runs)
    arrays: dict[str, Any] = {
        "names": np.array(emulator.names),
        "runs": np.array(emulator.runs),
        "u": emulator.inputs(dataset.parameters[used]),
        "parameters": dataset.parameters[used],
        "scaling": np.stack([emulator.scaling.low, emulator.scaling.high]),
        "lows": np.stack([r.lows for r in emulator.regions]),
        "highs": np.stack([r.highs for r in emulator.regions]),
        "flat": np.stack([r.flat for r in emulator.regions]),
        "channels": np.array(list(emulator.channels)),
        "scales": np.array(emulator.scales, dtype=str),
    }
    for i, (channel, curve) in enumerate(emulator.channels.items()):
        arrays[f"time_{i}"] = curve.time
        arrays[f"curves_{i}"] = dataset.curves[channel][used]
        arrays[f"kernels_{i}"] = np.array([p.kernel.theta for p in curve.processes])
    _save(path, **arrays)


def load_emulator(path: Path) -> Emulator:
    """What `save_emulator` wrote, conditioned on the same runs again."""
    with np.load(path) as file:
        u, channels = file["u"], {}
        for i, channel in enumerate(file["channels"]):
            kernels = [kernel_of(u.shape[1], theta) for theta in file[f"kernels_{i}"]]
            channels[str(channel)] = CurveEmulator.fit(file[f"time_{i}"], file[f"curves_{i}"], u, kernels=kernels)
        boxes = tuple(Region(*box) for box in zip(file["lows"], file["highs"], file["flat"], strict=True))
        names, runs = tuple(map(str, file["names"])), tuple(map(int, file["runs"]))
        scales = tuple(map(str, file["scales"])) if "scales" in file else ()  # older files hold linear features
        return Emulator(names, runs, boxes, Scaling(*file["scaling"]), jointly(channels), scales)


def read_region(path: Path) -> Array:
    """Ends (2, k) of the box in which runs stand behind a saved emulator, so that answers are sought there, SI."""
    with np.load(path) as file:
        return np.stack([file["lows"].min(axis=0), file["highs"].max(axis=0)])


def read_runs(path: Path) -> tuple[Array, dict[str, Array]]:
    """Parameters (n, k) SI and curves {channel: (n, m)} SI of the runs that a saved emulator learnt from.

    Older files hold no parameters: (0, k) then.
    """
    with np.load(path) as file:
        curves = {str(channel): file[f"curves_{i}"] for i, channel in enumerate(file["channels"])}
        theta = file["parameters"] if "parameters" in file else np.zeros((0, len(file["names"])))
        return theta, curves
