"""Reads the shards of docs/datasets.md with PyTorch, and learns to find the mines of scenes/datasets/mines.yaml."""
import io
import json
import tarfile

import numpy as np
import PIL.Image
import torch
import webdataset


def pings(shard):
    """The pings of a shard, by NumPy: key, {ending: array, or what the JSON has}."""
    ping = {}
    for member in (tar := tarfile.open(shard)):
        key, ending = member.name.split(".", 1)
        data = tar.extractfile(member).read()
        ping[ending] = json.loads(data) if ending == "json" else np.array(PIL.Image.open(io.BytesIO(data)))
        if ending == "json":
            yield key, ping
            ping = {}


def picture(ending, data):
    """For WebDataset, whose own decoders cut 16 bits to 8."""
    return np.array(PIL.Image.open(io.BytesIO(data))) if ending.endswith(".png") else None


loader = (webdataset.WebDataset("mines/shard-{000000..000001}.tar", shardshuffle=False).decode(picture)
          .to_tuple("samples.png", "labels.png", "json"))


class Pings(torch.utils.data.IterableDataset):
    """Pictures, and masks of a class, by the generator above."""

    def __init__(self, shards, wanted):
        self.shards, self.wanted = shards, wanted

    def __iter__(self):
        for shard in self.shards:
            for _, p in pings(shard):
                full_scale = 2.0 ** p["json"]["settings"]["bits"] - 1
                mask = np.isin(p["labels.png"], [i["instance"] for i in p["json"]["instances"] if i["class"] == self.wanted])
                yield torch.tensor(p["samples.png"] / full_scale).float()[None], torch.tensor(mask).float()[None]


net = torch.nn.Sequential(torch.nn.Conv2d(1, 8, 7, padding=3), torch.nn.ReLU(), torch.nn.Conv2d(8, 1, 5, padding=2))
loss_of = torch.nn.BCEWithLogitsLoss(pos_weight=torch.tensor(50.0))  # few samples are of a mine
optimizer = torch.optim.Adam(net.parameters(), 1e-2)
for epoch in range(8):
    for pictures, masks in torch.utils.data.DataLoader(Pings(["mines/shard-000000.tar"], "mine"), batch_size=4):
        optimizer.zero_grad()
        loss = loss_of(net(pictures), masks)
        loss.backward()
        optimizer.step()
    print(epoch, loss.item())  # net(pictures) > 0: samples predicted as a mine
