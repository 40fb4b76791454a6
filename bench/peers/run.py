#!/usr/bin/env python3
"""Renders scenes of Nephroid by other renderers, for `nephroid chart --peers`.

    bench/peers/install.sh                                          # once
    bench/peers/venv/bin/python bench/peers/run.py scenes/ring.json … -o chart/peers --seconds 20
    nephroid chart scenes/ring.json … -o chart --peers chart/peers

Each renderer and method runs in a process of its own, and its pictures at growing CPU seconds are kept as npy (float32,
height x width x 3, linear radiance); peers.json says which is what. The clock counts user and system time of all threads
spent rendering, photons and caches included, without start, reading of the scene and compilation of kernels. A renderer
that is not installed is left out, and said to be.
"""
import argparse
import datetime
import importlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
RENDERERS = ['povray', 'luxcore', 'mitsuba3']


def times(seconds):
    """A half, a quarter, … of the budget, down to half a second, in growing order."""
    out = [seconds]
    while out[-1] > 1:
        out.append(out[-1] / 2)
    return out[::-1]


def child(renderer, method, path, a):
    import numpy as np
    import scene
    loaded = scene.load(path)
    width, height = loaded['size']
    if a.width and a.width < width:
        loaded['size'] = (a.width, height * a.width // width)
    module = importlib.import_module(renderer)
    base = '-'.join([loaded['name'], renderer, method.replace(' ', '-')])
    shots = []
    for k, (cpu, image) in enumerate(module.run(method, loaded, times(a.seconds), a.threads)):
        file = f'{base}-{k}.npy'
        np.save(os.path.join(a.output, file), np.ascontiguousarray(image, np.float32))
        shots.append(dict(cpu_seconds=round(cpu, 4), image=file))
    out = dict(scene=loaded['name'], name=f'{module.name()}: {method}', shots=shots)
    print('RESULT ' + json.dumps(out), flush=True)
    os._exit(0)  # pyluxcore can crash when the interpreter ends


def machine():
    model = ''
    if os.path.exists('/proc/cpuinfo'):
        with open('/proc/cpuinfo') as f:
            found = re.search(r'model name\s*: (.*)', f.read())
        model = found.group(1) if found else ''
    return f'{model or platform.processor() or platform.machine()}, {os.cpu_count()} cores'


def main():
    p = argparse.ArgumentParser(description='see the top of this file')
    p.add_argument('scenes', nargs='+')
    p.add_argument('-o', '--output', default='chart/peers')
    p.add_argument('--seconds', type=float, default=20, help='CPU seconds of each method')
    p.add_argument('--width', type=int, help='most pixels across')
    p.add_argument('--threads', type=int, default=os.cpu_count())
    p.add_argument('--renderer', action='append', choices=RENDERERS)
    p.add_argument('--child', nargs=2, help=argparse.SUPPRESS)
    a = p.parse_args()
    os.makedirs(a.output, exist_ok=True)
    if a.child:
        return child(*a.child, a.scenes[0], a)
    runs = []
    for renderer in a.renderer or RENDERERS:
        try:
            module = importlib.import_module(renderer)
            print(module.name(), flush=True)
        except ImportError as missing:
            print(f'{renderer} is left out: {missing}', flush=True)
            continue
        for path in a.scenes:
            scene = os.path.splitext(os.path.basename(path))[0]
            for method in module.METHODS:
                if (method, scene) in module.BLIND:
                    continue
                command = [sys.executable, os.path.abspath(__file__), path, '-o', a.output, '--seconds', str(a.seconds),
                           '--threads', str(a.threads), '--width', str(a.width or 0), '--child', renderer, method]
                done = subprocess.run(command, capture_output=True, text=True)
                results = [line[7:] for line in done.stdout.split('\n') if line.startswith('RESULT ')]
                if not results:
                    print(f'failed: {renderer}, {method}, {scene}:\n{done.stdout[-500:]}{done.stderr[-1500:]}', file=sys.stderr)
                    return 1
                runs.append(json.loads(results[0]))
                print(f'  {scene}: {method}: {len(runs[-1]["shots"])} pictures', flush=True)
    about = dict(machine=machine(), date=datetime.date.today().isoformat(), threads=a.threads, runs=runs)
    with open(os.path.join(a.output, 'peers.json'), 'w') as f:
        json.dump(about, f, indent=1)
    shutil.copy(os.path.join(HERE, 'stored.json'), a.output)
    return 0


if __name__ == '__main__':
    sys.exit(main())
