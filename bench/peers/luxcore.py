"""LuxCore: bidirectional path tracing, vertex merging, and path tracing with a cache of photons for caustics."""
import time
from importlib.metadata import version

import numpy as np

VISIBILITY = {'path.photongi.visibility.maxsamplecount': 65536, 'path.photongi.visibility.lookup.radius': 0.1}


def photon_cache(radius, size, update):
    """A density estimate of fixed radius, remade every few samples with a slightly smaller one."""
    return {'renderengine.type': 'PATHCPU', 'path.photongi.caustic.enabled': 1, 'path.photongi.photon.maxdepth': 16,
            'path.photongi.caustic.lookup.radius': radius, 'path.photongi.caustic.maxsize': size,
            'path.photongi.caustic.updatespp': update, 'path.photongi.caustic.updatespp.minradius': 0.003,
            'path.photongi.caustic.updatespp.radiusreduction': 0.96, **VISIBILITY}


METHODS = {
    'bidirectional': {'renderengine.type': 'BIDIRCPU', 'sampler.type': 'RANDOM'},
    'vertex merging': {'renderengine.type': 'BIDIRVMCPU', 'sampler.type': 'RANDOM'},
    'photon cache': photon_cache(0.01, 50000, 4),
}
# Its caustic fills the pool and is smooth: wider kernels.
OF_SCENE = {('photon cache', 'pool'): photon_cache(0.05, 200000, 8),
            ('vertex merging', 'pool'): dict(METHODS['vertex merging'], **{'bidirvm.startradius.scale': 0.02})}
# It would have to meet the light by chance.
BLIND = {('bidirectional', 'pool')}


def name():
    return f'LuxCore {version("pyluxcore")}'


def icosphere(center, radius, levels=6):
    """LuxCore has no sphere: 20 * 4^levels triangles with the sphere's own normals."""
    t = (1 + 5**0.5) / 2
    v = np.array([(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
                  (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)], float)
    f = np.array([(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2),
                  (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11),
                  (6, 2, 10), (8, 6, 7), (9, 8, 1)])
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    for _ in range(levels):
        edges = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        inverse = inverse.ravel()
        middle = v[unique[:, 0]] + v[unique[:, 1]]
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        n, k = len(v), len(f)
        a, b, c = n + inverse[:k], n + inverse[k:2 * k], n + inverse[2 * k:]
        f = np.concatenate([np.stack(x, 1) for x in ([f[:, 0], a, c], [f[:, 1], b, a], [f[:, 2], c, b], [a, b, c])])
        v = np.concatenate([v, middle])
    return v * radius + center, v, f


def convert(lux, scene):
    out, props = lux.Scene(), lux.Properties()

    def put(key, *v):
        props.Set(lux.Property(key, list(v) if len(v) > 1 else v[0]))

    def rows(a):
        return [tuple(r) for r in np.asarray(a).tolist()]

    def add(label, P, N, F):
        out.DefineMesh(label, rows(P), rows(F), None if N is None else rows(N), None, None, None)
        put(f'scene.objects.{label}.shape', label)
        put(f'scene.objects.{label}.material', 'm_' + label)

    camera, (width, height) = scene['camera'], scene['size']
    put('scene.camera.type', 'perspective')
    put('scene.camera.lookat.orig', *map(float, camera['eye']))
    put('scene.camera.lookat.target', *map(float, camera['target']))
    put('scene.camera.up', *map(float, camera['up']))
    put('scene.camera.fieldofview', float(camera['fov']))
    # Its raster is one pixel off vertically; the window is moved by one to make up for it.
    aspect, pixel = width / height, 2 / height
    put('scene.camera.screenwindow', -aspect, aspect, -1.0 - pixel, 1.0 - pixel)
    put('scene.camera.autovolume.enable', 0)
    for i, s in enumerate(scene['shapes']):
        label, m = f's{i}', scene['materials'][s['material']]
        key = f'scene.materials.m_{label}.'
        if m['type'] == 'diffuse':
            put(key + 'type', 'matte')
            put(key + 'kd', *map(float, m['albedo']))
        elif m['type'] == 'mirror':
            put(key + 'type', 'mirror')
            put(key + 'kr', *map(float, m['reflectance']))
        else:
            put(key + 'type', 'glass')
            put(key + 'kr', 1.0, 1.0, 1.0)
            put(key + 'kt', 1.0, 1.0, 1.0)
            put(key + 'interiorior', float(m['ior']))
            put(key + 'exteriorior', 1.0)
        add(label, *(icosphere(*s['ball']) if 'ball' in s else (s['P'], s['N'], s['F'])))
    for i, light in enumerate(scene['lights']):
        label = f'l{i}'
        key = f'scene.materials.m_{label}.'
        put(key + 'type', 'matte')
        put(key + 'kd', 0.0, 0.0, 0.0)
        put(key + 'emission', *light['radiance'].tolist())
        put(key + 'emission.gain', 1.0, 1.0, 1.0)
        put(key + 'emission.power', 0.0)
        put(key + 'emission.efficency', 0.0)
        put(key + 'emission.normalizebycolor', 0)
        add(label, light['corners'], None, np.array([[0, 1, 2], [0, 2, 3]]))
    out.Parse(props)
    return out


def settings(lux, scene, method, threads):
    width, height = scene['size']
    values = {
        'film.width': width, 'film.height': height, 'film.filter.type': 'NONE', 'film.imagepipelines.0.0.type': 'NOP',
        'film.imagepipelines.0.radiancescales.0.enabled': 1, 'film.outputs.0.type': 'RGB_IMAGEPIPELINE',
        'film.outputs.0.index': 0, 'film.outputs.0.filename': 'unused.exr', 'native.threads.count': threads,
        'path.pathdepth.total': 32, 'path.pathdepth.diffuse': 32, 'path.pathdepth.glossy': 32,
        'path.pathdepth.specular': 32, 'path.maxdepth': 32, 'light.maxdepth': 32, 'path.russianroulette.depth': 8,
        'path.clamping.variance.maxvalue': 0.0, 'sampler.type': 'SOBOL',
        **OF_SCENE.get((method, scene['name']), METHODS[method])}
    props = lux.Properties()
    for key, value in values.items():
        props.Set(lux.Property(key, value))
    return props


def run(method, scene, times, threads):
    """Yields CPU seconds and pictures at about these times."""
    import pyluxcore as lux  # after numpy, or its allocator crashes
    lux.Init(lambda line: None)
    converted = convert(lux, scene)
    session = lux.RenderSession(lux.RenderConfig(settings(lux, scene, method, threads), converted))
    want, (width, height) = list(times), scene['size']
    start = time.process_time()
    session.Start()  # photons and caches included
    waiting = time.thread_time()
    while want:
        time.sleep(0.01)
        # This thread only waits and takes pictures: its own time is no rendering.
        cpu = time.process_time() - start - (time.thread_time() - waiting)
        if cpu < 0.97 * want[0]:
            continue
        while want and cpu >= 0.97 * want[0]:
            want.pop(0)
        session.UpdateStats()
        image = np.zeros((height, width, 3), np.float32)
        session.GetFilm().GetOutputFloat(lux.FilmOutputType.RGB_IMAGEPIPELINE, image, 0)
        yield cpu, image[::-1].copy()
    session.Stop()
