def distance(a, b):
    return bin(a ^ b).count("1")


def turned(code):
    seen = {}
    for i, (x, y) in enumerate(bits):
        seen[(width - 1 - y, x)] = (code >> (len(bits) - 1 - i)) & 1
    answer = 0
    for cell in bits:
        answer = 2 * answer + seen[cell]
    return answer


def family_distance(codes):
    best = len(bits)
    for i, a in enumerate(codes):
        b = a
        for _ in range(3):
            b = turned(b)
            best = min(best, distance(a, b))
        for b in codes[i + 1:]:
            for _ in range(4):
                best = min(best, distance(a, b))
                b = turned(b)
    return best


def correctable(d):
    return (d - 1) // 2


WRONG = {
    "bits in common": ("a ^ b", "a & b", "wrong for 0000000000000001 and 0000000000000010"),
    "turned the other way": ("(width - 1 - y, x)", "(y, width - 1 - x)", "it rotates counter-clockwise"),
    "mirrored": ("(width - 1 - y, x)", "(y, x)", "some bits are in the wrong cells"),
    "least significant bit first": ("(len(bits) - 1 - i)", "i", "some bits are in the wrong cells"),
    "no turns between codes": ("range(4)", "range(1)", "wrong for a code together with its own quarter turn: can a"),
    "no turns of a code itself": ("range(3)", "range(0)", "wrong for a family with a code that equals its own"),
    "half the distance": ("(d - 1) // 2", "d // 2", "too many for a distance of"),
}
