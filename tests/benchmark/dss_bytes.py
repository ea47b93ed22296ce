"""Where the bytes of a .dss file go (docs/dss-format.md)."""


def varint(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        at, value, shift = at + 1, value | (byte & 127) << shift, shift + 7
        if byte < 128:
            return value, at


def spent(data):
    """Kind to bytes."""
    kinds = dict(framing=9, header=0, metadata=0, creases=0, mesh=0, heights=0, flags=0)
    at = 9
    while at < len(data):
        tag = chr(data[at])
        size, begin = varint(data, at + 1)
        end = begin + size
        kinds["framing"] += begin - at + 4
        if tag == "C":
            head, place = varint(data, begin)
            header = data[place:place + head]
            _, counts = varint(header, 1)
            _, counts = varint(header, counts)
            counts += 1
            if header[0] & 8:
                _, counts = varint(header, counts)
            for _ in range(6):
                counts += 1 + header[counts]
            tags = 0
            if header[0] & 4:
                tags, after = varint(data, place + head)
                tags += after - place - head
            kinds["header"] += counts + place - begin
            kinds["metadata"] += head - counts
            kinds["creases"] += tags
            kinds["mesh"] += end - place - head - tags
        else:
            kinds["heights" if tag == "H" else "flags"] += size
        at = end + 4
    return kinds
