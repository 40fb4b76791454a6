"""A scene file of Nephroid as plain numbers and meshes, for the converters to other renderers.

Only what the charted scenes use is read: polygons without holes, spheres and meshes; diffuse, mirror and glass; quad
lights; a pinhole. Anything else is an error: a scene is never converted in part.
"""
import gzip
import json
import os

import numpy as np


def normalize(v):
    v = np.asarray(v, float)
    return v / np.linalg.norm(v)


def load(path):
    """camera, size (width, height), shapes [(name, material, P, N or None, F or ball)], materials, lights."""
    with open(path) as f:
        scene = json.load(f)
    unread = set(scene) - {'nephroid', 'name', 'image', 'camera', 'materials', 'objects', 'lights', 'render'}
    if unread:
        raise ValueError(f'{path}: not converted: {sorted(unread)}')
    camera = scene['camera']
    if camera['type'] != 'perspective' or camera.get('aperture'):
        raise ValueError(f'{path}: only pinhole cameras are converted')
    return dict(
        name=os.path.splitext(os.path.basename(path))[0],
        size=(scene['image']['width'], scene['image']['height']),
        camera=dict(eye=camera['eye'], target=camera['target'], up=camera.get('up', [0, 1, 0]), fov=camera['fov']),
        materials={name: material(m) for name, m in scene['materials'].items()},
        shapes=[shape(o, os.path.dirname(path)) for o in scene['objects']],
        lights=[quad(light) for light in scene['lights']])


def material(m):
    allowed = {'diffuse': {'albedo'}, 'mirror': {'reflectance'}, 'glass': {'ior'}}
    kind = m['type']
    if kind not in allowed or set(m) - {'type'} != allowed[kind] or isinstance(m.get('albedo'), dict):
        raise ValueError(f'not converted: the material {m}')
    return m


def shape(o, folder):
    """A ball, or a mesh whose faces run anticlockwise seen from the front; N is None where it is flat."""
    name = o.get('name', 'shape').replace(' ', '_')
    unread = set(o) - {'name', 'type', 'material', 'center', 'radius', 'vertices', 'asset'}
    if unread:
        raise ValueError(f'not converted: {sorted(unread)} of {name}')
    out = dict(name=name, material=o['material'])
    if o['type'] == 'sphere':
        return dict(out, ball=(np.asarray(o['center'], float), float(o['radius'])))
    if o['type'] == 'polygon':
        P = np.asarray(o['vertices'], float)
        F = np.array([[0, i, i + 1] for i in range(1, len(P) - 1)])
        return dict(out, P=P, N=None, F=F)
    if o['type'] == 'mesh' and 'asset' in o:
        return dict(out, **ply(os.path.join(folder, o['asset'])))
    raise ValueError(f'not converted: a shape of type {o["type"]}')


def ply(path):
    """Vertices, normals and triangles of a PLY file, ASCII or binary, gzip-packed or not."""
    with (gzip.open if path.endswith('.gz') else open)(path, 'rb') as f:
        data = f.read()
    head, _, body = data.partition(b'end_header\n')
    lines = head.decode().split('\n')
    form = next(line.split()[1] for line in lines if line.startswith('format'))
    elements, types = [], {'float': 'f4', 'float32': 'f4', 'double': 'f8', 'int': 'i4', 'int32': 'i4', 'uint': 'u4',
                           'uint32': 'u4', 'uchar': 'u1', 'uint8': 'u1', 'ushort': 'u2', 'short': 'i2'}
    for line in lines:
        words = line.split()
        if words[:1] == ['element']:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ['property']:
            elements[-1][2].append(words[1:])
    (vertex, n, props), (face, m, lists) = elements
    if (vertex, face) != ('vertex', 'face') or lists[0][0] != 'list':
        raise ValueError(f'{path}: not the PLY that is expected')
    names = [p[1] for p in props]
    if form == 'ascii':
        numbers = body.split()
        V = np.array(numbers[:n * len(names)], float).reshape(n, -1)
        F = np.array(numbers[n * len(names):], int).reshape(m, -1)
    else:
        order = '<' if form == 'binary_little_endian' else '>'
        vertex_type = np.dtype([(p[1], order + types[p[0]]) for p in props])
        face_type = np.dtype([('n', order + types[lists[0][1]]), ('i', order + types[lists[0][2]], 3)])
        flat = np.frombuffer(body, vertex_type, n)
        V = np.stack([flat[name] for name in names], 1).astype(float)
        faces = np.frombuffer(body, face_type, m, n * vertex_type.itemsize)
        F = np.concatenate([faces['n'][:, None], faces['i']], 1).astype(int)
    if not (F[:, 0] == 3).all():
        raise ValueError(f'{path}: faces that are not triangles')
    P = V[:, [names.index(c) for c in 'xyz']]
    N = V[:, [names.index(c) for c in ('nx', 'ny', 'nz')]] if 'nx' in names else None
    return dict(P=P, N=N, F=F[:, 1:])


def quad(light):
    """Corners anticlockwise seen from the lit side, centre, normal, axes and side of a square light."""
    if light['type'] != 'quad':
        raise ValueError(f'not converted: a light of type {light["type"]}')
    center = np.asarray(light['center'], float)
    normal = normalize(np.asarray(light['towards'], float) - center)
    edge = light.get('edge')
    u = normalize(np.cross([0, 1, 0], normal) if edge is None else edge)
    u = normalize(u - normal * np.dot(u, normal))
    v = np.cross(normal, u)
    a, b = u * light['size'][0] / 2, v * light['size'][1] / 2
    corners = np.array([center - a - b, center + a - b, center + a + b, center - a + b])
    return dict(center=center, normal=normal, u=u, v=v, size=light['size'], corners=corners,
                radiance=np.asarray(light['radiance'], float))


def basis(camera):
    """Unit forward, right and up of the picture."""
    forward = normalize(np.subtract(camera['target'], camera['eye']))
    right = normalize(np.cross(forward, camera['up']))
    return forward, right, np.cross(right, forward)
