"""POV-Ray: photons aimed at what is specular, gathered by the nearest; direct light from a fixed grid of points.

It follows no light from one diffuse surface to another, so that it runs on the scenes that hardly have any. Each picture
is a render of its own, with photons at half the distance or less.
"""
import os
import re
import shutil
import subprocess
import tempfile

import numpy as np
import scene as scenes

METHODS = {'photons': None}
BLIND = {('photons', 'cornell'), ('photons', 'pool')}

# Spacing of photons in metres, least and most of them in a gather, points across a light, rays across a pixel.
STEPS = [(0.02, 20, 60, 3, 1), (0.01, 20, 80, 5, 1), (0.005, 20, 80, 5, 1), (0.002, 30, 150, 7, 1),
         (0.001, 40, 200, 9, 1), (0.001, 40, 200, 9, 2)]
# Inverse squares from this distance on, m.
FADE = 0.01


def name():
    if not shutil.which('povray'):
        raise ImportError('no povray on the path')
    said = subprocess.run(['povray', '--version'], capture_output=True, text=True)
    return 'POV-Ray ' + re.search(r'POV-Ray (\d+\.\d+)', said.stderr + said.stdout).group(1)


def vector(v):
    return '<' + ','.join(f'{x:.9g}' for x in np.asarray(v, float)) + '>'


def convert(scene, spacing, least, most, across):
    camera, (width, height) = scene['camera'], scene['size']
    forward, right, up = scenes.basis(camera)
    out = ['#version 3.7;',
           'global_settings { assumed_gamma 1.0 max_trace_level 20 adc_bailout 0.0005 ambient_light 0',
           f'  photons {{ spacing {spacing} gather {least},{most} autostop 0 jitter 0.4 max_trace_level 20 adc_bailout 0.0005 }} }}',
           'background { color rgb 0 }',
           f'camera {{ perspective location {vector(camera["eye"])} '
           f'direction {vector(forward * 0.5 / np.tan(np.radians(camera["fov"]) / 2))} '
           f'right {vector(right * width / height)} up {vector(up)} }}']
    for light in scene['lights']:
        # Radiance R and area A are an intensity R A cos; its floor returns albedo * intensity * cos * 2/(1 + (d/FADE)^2).
        intensity = light['radiance'] * light['size'][0] * light['size'][1] / np.pi / (2 * FADE**2)
        u, v = (light[k] * side * (across - 1) / across for k, side in zip('uv', light['size']))
        out += [f'light_source {{ {vector(light["center"])} color rgb {vector(intensity)}',
                f'  spotlight point_at {vector(light["center"] + light["normal"])} radius 90 falloff 90 tightness 1',
                f'  area_light {vector(u)}, {vector(v)}, {across}, {across} area_illumination on',
                f'  fade_distance {FADE} fade_power 2 photons {{ reflection on refraction on area_light }} }}']
    for s in scene['shapes']:
        m = scene['materials'][s['material']]
        if m['type'] == 'diffuse':
            look = (f'pigment {{ color rgb {vector(m["albedo"])} }} '
                    'finish { ambient 0 emission 0 diffuse 1 brilliance 1 } photons { collect on }')
        elif m['type'] == 'mirror':
            look = (f'pigment {{ color rgb 0 }} finish {{ ambient 0 diffuse 0 reflection {{ rgb {vector(m["reflectance"])} }} }} '
                    'photons { target reflection on refraction off collect off }')
        else:
            look = (f'pigment {{ color rgbt 1 }} interior {{ ior {m["ior"]} }} '
                    'finish { ambient 0 diffuse 0 reflection { 0, 1 fresnel on } conserve_energy } '
                    'photons { target reflection on refraction on collect off }')
        if 'ball' in s:
            out.append(f'sphere {{ {vector(s["ball"][0])}, {s["ball"][1]} {look} }}')
            continue
        normals = '' if s['N'] is None else f'normal_vectors {{ {len(s["N"])}, {",".join(map(vector, s["N"]))} }}'
        faces = ','.join('<%d,%d,%d>' % tuple(f) for f in s['F'])
        out.append(f'mesh2 {{ vertex_vectors {{ {len(s["P"])}, {",".join(map(vector, s["P"]))} }} {normals} '
                   f'face_indices {{ {len(s["F"])}, {faces} }} {look} }}')
    return '\n'.join(out) + '\n'


def read_exr(path):
    import OpenEXR
    with OpenEXR.File(path) as f:
        channels = f.channels()
        if 'RGB' in channels or 'RGBA' in channels:
            return np.asarray((channels.get('RGB') or channels['RGBA']).pixels)[..., :3].astype(np.float32)
        return np.stack([channels[c].pixels for c in 'RGB'], -1).astype(np.float32)


def run(method, scene, times, threads):
    """Yields CPU seconds and pictures, until one takes longer than the last of these times."""
    width, height = scene['size']
    with tempfile.TemporaryDirectory() as folder:
        for spacing, least, most, across, rays in STEPS:
            base = os.path.join(folder, 'scene')
            with open(base + '.pov', 'w') as f:
                f.write(convert(scene, spacing, least, most, across))
            command = ['povray', f'+I{base}.pov', f'+O{base}.exr', '+FE', f'+W{width}', f'+H{height}', '-D', '+GA', f'+WT{threads}']
            command += ['-A'] if rays == 1 else ['+A0.0', '+AM1', f'+R{rays}', '-J']
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                raise RuntimeError(done.stderr[-2000:])
            parts = re.findall(r'with ([0-9.]+) CPU-seconds total', done.stderr.split('Render Time:')[-1])
            cpu = sum(map(float, parts))
            yield cpu, read_exr(base + '.exr')
            if cpu > times[-1]:
                return
