"""Mitsuba 3: path tracing, and light tracing connected to the eye. Unbiased; the picture is the mean of its parts."""
import time
from importlib.metadata import version

import numpy as np

METHODS = {'path': {'type': 'path', 'max_depth': -1}, 'light tracing': {'type': 'ptracer', 'max_depth': -1}}
# Light tracing sees nothing behind glass or in a mirror: nearly all of the pool.
BLIND = {('light tracing', 'pool')}


def name():
    return f'Mitsuba {version("mitsuba")}'


def convert(mi, scene, integrator):
    T = mi.ScalarTransform4f

    def rgb(v):
        return dict(type='rgb', value=[float(x) for x in v])

    def bsdf(m):
        if m['type'] == 'diffuse':
            return dict(type='twosided', b=dict(type='diffuse', reflectance=rgb(m['albedo'])))
        if m['type'] == 'glass':
            return dict(type='dielectric', int_ior=float(m['ior']), ext_ior=1.0)
        mirror = dict(type='conductor', material='none', specular_reflectance=rgb(m['reflectance']))
        return dict(type='twosided', b=mirror)

    def mesh(label, P, N, F, props):
        made = mi.Mesh(label, len(P), len(F), has_vertex_normals=N is not None, props=props)
        values = mi.traverse(made)
        values['vertex_positions'] = np.ascontiguousarray(P, np.float32).ravel()
        if N is not None:
            values['vertex_normals'] = np.ascontiguousarray(N, np.float32).ravel()
        values['faces'] = np.ascontiguousarray(F, np.uint32).ravel()
        values.update()
        return made

    camera, (width, height) = scene['camera'], scene['size']
    out = dict(type='scene', integrator=integrator, sensor=dict(
        type='perspective', fov=float(camera['fov']), fov_axis='y', near_clip=0.01, far_clip=1000.0,
        to_world=T().look_at(*([float(x) for x in camera[k]] for k in ('eye', 'target', 'up'))),
        film=dict(type='hdrfilm', width=width, height=height, pixel_format='rgb', component_format='float32',
                  rfilter=dict(type='box'), sample_border=False),
        sampler=dict(type='independent', sample_count=1)))
    for i, s in enumerate(scene['shapes']):
        m = bsdf(scene['materials'][s['material']])
        if 'ball' in s:
            center, radius = s['ball']
            out[f's{i}'] = dict(type='sphere', center=center.tolist(), radius=radius, bsdf=m)
        else:
            props = mi.Properties()
            props['bsdf'] = mi.load_dict(m)
            out[f's{i}'] = mesh(s['name'], s['P'], s['N'], s['F'], props)
    for i, light in enumerate(scene['lights']):
        frame = np.eye(4)
        frame[:3, 0], frame[:3, 1] = light['u'] * light['size'][0] / 2, light['v'] * light['size'][1] / 2
        frame[:3, 2], frame[:3, 3] = light['normal'], light['center']
        out[f'l{i}'] = dict(type='rectangle', to_world=mi.ScalarTransform4f(frame),
                            bsdf=dict(type='diffuse', reflectance=rgb((0, 0, 0))),
                            emitter=dict(type='area', radiance=rgb(light['radiance'])))
    return mi.load_dict(out)


def run(method, scene, times, threads):
    """Yields CPU seconds and pictures at about these times."""
    import mitsuba as mi
    mi.set_variant('llvm_ad_rgb' if 'llvm_ad_rgb' in mi.variants() else 'scalar_rgb')
    import drjit as dr
    dr.set_thread_count(threads)
    converted = convert(mi, scene, METHODS[method])
    for k in range(2):  # compiles the kernels, which is no rendering
        np.array(mi.render(converted, spp=1, seed=10**6 + k))
    total, samples, cpu, spp, seed = 0.0, 0, 0.0, 1, 0
    want = list(times)
    while want:
        start = time.process_time()
        total = total + spp * np.array(mi.render(converted, spp=spp, seed=seed), dtype=np.float64)
        spent = time.process_time() - start
        samples, seed, cpu = samples + spp, seed + 1, cpu + spent
        if cpu >= 0.9 * want[0]:
            while want and cpu >= 0.9 * want[0]:
                want.pop(0)
            yield cpu, (total / samples).astype(np.float32)
        if spent < 0.15 * cpu and spent < 2 and spp < 64:
            spp *= 2
