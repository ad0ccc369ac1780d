#!/usr/bin/env python3
"""Seeds one fault at a time in solver, headers and shaders and runs the suite: every fault must be caught.

    seed.py SOURCE SCRATCH [FIRST [LAST]]
    seed.py SOURCE                           only: does every fault still apply?

Works in SCRATCH, a copy of SOURCE with a build folder of its own. A fault is a file, a text that occurs once in it, and what takes its
place. The tests that take seconds judge first; what they miss goes to the rest of the suite, and what fails there must pass without the fault.
Prints one line for each fault: caught, by which test, or MISSED; exits 1 if any was missed or no longer applies.
"""
import concurrent.futures
import os
import re
import subprocess
import sys
import time

FAULTS = [
    # camera
    ('include/gnomon/camera.h', 'return isReversed ? n / z * ((f - z) / (f - n)) : f / (f - n) * ((z - n) / z);', 'return isReversed ? n / z * ((f - z) / (f - n)) : f / (f - n) * ((z - n) / f);', 'eq. 8 as misprinted'),
    ('solver/camera.cpp', 'const double fromNear = isReversed ? 1.0 - d : d, fromFar', 'const double fromNear = isReversed ? d : d, fromFar', 'wrong depth convention'),
    ('include/gnomon/camera.h', 'constexpr double kRounding = 2.0 * kFloatUlp;', 'constexpr double kRounding = 0.0 * kFloatUlp;', 'dropped depth quantum'),
    # region
    ('solver/region.cpp', 'cell.vertices[i] = glm::dvec3(((i & 1) ? camera.right : -camera.left) * k,', 'cell.vertices[i] = glm::dvec3(((i & 1) ? camera.left : -camera.right) * k,', 'swapped tangents'),
    ('solver/region.cpp', 'const Plane plane{normal * region.worldFromView, atEye + p.w};', 'const Plane plane{normal * region.worldFromView, atEye - p.w};', 'half-space of the wrong sign'),
    ('solver/region.cpp', 'if (distance + reach < -rounding) return Where::outside;', 'if (distance - reach < -rounding) return Where::outside;', 'a box across a side taken for one beyond it'),
    ('solver/region.cpp', '{-viewFromWorld[axis], greatest - eye}', '{-viewFromWorld[axis], greatest + eye}', 'box moved by the eye'),
    ('solver/region.cpp', 'const double room = samples.latency + (near == far', 'const double room = (near == far', 'dropped latency'),
    # split
    ('solver/split.cpp', 'if (hasBefore) near -= margin.blend * (slice.near - splits.slices[i - 1].near);', '', 'dropped blend band'),
    ('solver/split.cpp', 'needed = std::max(needed, isFresh ? 1 : 0);', 'needed = std::max(needed, 0);', 'off-by-one split'),
    ('solver/split.cpp', 'double near = slice.near - (hasBefore ? atFar : quantum(slice.near));', 'double near = slice.near;', 'unpadded near end'),
    # footprint
    ('solver/footprint.cpp', 'footprint.apart = apart;', 'footprint.apart = 0.0;', 'copies that do not cover'),
    ('solver/footprint.cpp', 'edge.end > slab.far ? addBetween(edge, slab.far) : addVertex(edge.to);', 'addVertex(edge.to);', 'slice not cut at its far end'),
    ('solver/footprint.cpp', 'width = std::min(width, all.pixels[i]);', 'width = all.pixels[i];', 'not the least width of a band'),
    # fit
    ('solver/fit.cpp', 'fit.least = bounds.least * perLength - (size - span) / 2.0;', 'fit.least = bounds.least * perLength;', 'thin hull not centred'),
    ('solver/fit.cpp', 'const glm::dvec2 inner = texels - 2.0 * margin - (isSnapped ? 1.0 : 0.0);', 'const glm::dvec2 inner = texels - (isSnapped ? 1.0 : 0.0);', 'dropped margin'),
    ('solver/fit.cpp', 'if (frame.shadowMap.depth == DepthConvention::reversedZeroToOne) perDepth *= -1.0, byW = 1.0;', '', 'reversed map drawn forward'),
    ('solver/fit.cpp', 'const double flip = frame.shadowMap.style == ClipStyle::vulkan ? -1.0 : 1.0;', 'const double flip = 1.0;', 'Vulkan y not flipped'),
    ('solver/fit.cpp', 'snapped = glm::floor((eye + covering) / texel) * texel - eye;', 'snapped = covering;', 'no snapping'),
    ('solver/fit.cpp', 'rounding = (kFloatRounding * glm::dvec2(sizeOf(fit.s), sizeOf(fit.t)) + farthest * lostOfW) / (1.0 - lostOfW);', 'rounding = glm::dvec2(0.0);', 'a warp without room for rounding'),
    # cast
    ('solver/cast.cpp', 'fit.depthFar += range * fit.depthLost;', '', 'depth lost over casters'),
    ('solver/cast.cpp', 'const glm::dvec2 inward = glm::dvec2(-edge.y, edge.x)', 'const glm::dvec2 inward = glm::dvec2(edge.y, -edge.x)', 'cull planes inside out'),
    # atlas, block
    ('solver/atlas.cpp', 'glm::ivec4(x + border, y + border, sizes[cell.map])', 'glm::ivec4(x, y, sizes[cell.map])', 'border on one side only'),
    ('solver/block.cpp', 'frame.shadowMap.style == ClipStyle::direct3d ? -0.5 : 0.5;', 'frame.shadowMap.style == ClipStyle::direct3d ? 0.5 : 0.5;', 'Direct3D lookup upside down'),
    ('solver/block.cpp', 'const double fadeFrom = region.far - frame.fade * (region.far - region.near);', 'const double fadeFrom = region.far - frame.fade * region.far;', 'fade of the wrong length'),
    ('solver/block.cpp', 'block.originRest = vec4(glm::vec3(solution.originWs - glm::dvec3(origin)), 0.0f);', 'block.originRest = vec4(0.0f);', 'origin rounded to float32'),
    # error, warp, face, rows, histogram, sdsm
    ('solver/error.cpp', 'widest * widest * texels', 'widest * texels', 'spent texels by length'),
    ('solver/rows.cpp', 'width /= 1.0 - 2.0 * (isNarrow ? shape.tangent : zeta);', 'width /= 1.0 - (isNarrow ? shape.tangent : zeta);', 'eq. 1 without its 2'),
    ('solver/rows.cpp', 'std::expm1(grown / count)', 'std::expm1(grown / (count + 1))', 'off-by-one row'),
    # glsl
    ('glsl/gnomon_pssm.glsl', 'return int(dot(begun, vec4(1.0))) - 1;', 'return int(dot(begun, vec4(1.0)));', 'off-by-one partition'),
    ('glsl/gnomon_pssm.glsl', 'vec4 p = begun.w > 0.0 ? at3 : begun.z > 0.0 ? at2 : begun.y > 0.0 ? at1 : at0;', 'vec4 p = begun.w > 0.0 ? at3 : begun.y > 0.0 ? at2 : begun.z > 0.0 ? at1 : at0;', 'swapped components'),
    ('glsl/gnomon_lookup.glsl', 'vec4(1.0 - f.x, 2.0 - f.x, 1.0 + f.x, f.x)', 'vec4(1.0 - f.x, 2.0 - f.x, 1.0 + f.x, 1.0 - f.x)', 'lopsided tent'),
    ('glsl/gnomon_lookup.glsl', 'return world + normal * (height +', 'return world - normal * (height +', 'bias away from the light'),
    ('glsl/gnomon_lookup.glsl', 'vec2 inset = 0.5 * atlas.zw;', 'vec2 inset = vec2(0.0);', 'taps in the next map'),
    ('glsl/gnomon_lookup.glsl', 'clamp((depthRule.z - viewDepth) * depthRule.w, 0.0, 1.0)', 'clamp((depthRule.y - viewDepth) * depthRule.w, 0.0, 1.0)', 'fade from the wrong end'),
    ('glsl/gnomon_cast.glsl', 'return vec4(2.0 * atlas.xy - own.w, own.z, own.w);', 'return vec4(2.0 * atlas.xy + own.w, own.z, own.w);', 'atlas position off by w'),
    ('glsl/gnomon_lloyd.glsl', 'along >= range.x && along < range.y', 'along > range.x && along <= range.y', 'half-open at the wrong end'),
    ('glsl/gnomon_lloyd.glsl', 'if (mask == vec4(0.0)) { mask = mask8; first = 8; }', 'if (mask == vec4(0.0)) { mask = mask8; first = 4; }', 'wrong group of four'),
    ('glsl/gnomon_blend.glsl', '(viewDepth - layer.y) * layer.z', '(layer.y - viewDepth) * layer.z', 'blend falls where it should rise'),
]
SHADERS = '*Parity*:SdsmReduction*'
SLOW = 'Predicted*:Figures*:Job*:Scene*:Truth*:Check*:Readme*:Glsl*:Picture*:Wrong*:Cases*:Report*:Cli*:*BuiltIn*'


def run(arguments):
    return subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def first_failure(tests, filter):
    """The first test that fails, '' where all pass. A process for each core; a failure stops the others."""
    count = os.cpu_count() or 1
    shards = [subprocess.Popen([tests, '--gtest_fail_fast', '--gtest_brief=1', '--gtest_filter=' + filter],
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors='replace',
                               env=os.environ | {'GNOMON_SOAK': '500', 'GTEST_TOTAL_SHARDS': str(count), 'GTEST_SHARD_INDEX': str(i)})
              for i in range(count)]
    failure = ''
    with concurrent.futures.ThreadPoolExecutor(count) as readers:
        reading = {readers.submit(shard.communicate, timeout=3600): shard for shard in shards}
        for ended in concurrent.futures.as_completed(reading):
            if failure or (not ended.exception() and reading[ended].returncode == 0):
                continue
            named = None if ended.exception() else re.search(r'\[  FAILED  \] ([\w/.]+)', ended.result()[0])
            failure = named.group(1) if named else 'a hang' if ended.exception() else 'a crash'
            for shard in shards:
                shard.kill()
    return failure


def stale(source):
    """Faults whose text does not occur once."""
    return [f'{name}: {what}: no longer applies' for name, old, _, what in FAULTS
            if open(os.path.join(source, name), encoding='utf-8').read().count(old) != 1]


def main():
    source = os.path.abspath(sys.argv[1])
    if len(sys.argv) == 2:
        sys.exit('\n'.join(stale(source)) or 0)
    scratch = os.path.abspath(sys.argv[2])
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    last = int(sys.argv[4]) if len(sys.argv) > 4 else len(FAULTS)
    tree, build = os.path.join(scratch, 'tree'), os.path.join(scratch, 'build')
    os.makedirs(tree, exist_ok=True)
    files = run(['git', '-C', source, 'ls-files', '--cached', '--others', '--exclude-standard']).stdout.split('\n')
    for name in filter(None, files):
        to, text = os.path.join(tree, name), open(os.path.join(source, name), 'rb').read()
        if os.path.exists(to) and open(to, 'rb').read() == text:
            continue  # what is the same stays as old as it is
        os.makedirs(os.path.dirname(to), exist_ok=True)
        with open(to, 'wb') as out:
            out.write(text)
    configured = run(['cmake', '-S', tree, '-B', build, '-G', 'Ninja', '-DCMAKE_BUILD_TYPE=Release', '-DGNOMON_WERROR=OFF'] + os.environ.get('GNOMON_CMAKE', '').split())
    if configured.returncode != 0:
        sys.exit(configured.stdout)
    tests = os.path.join(build, 'tests', 'gnomon_tests')
    command = ['cmake', '--build', build, '--target', 'gnomon_tests']

    built = run(command)
    if built.returncode != 0:
        sys.exit(built.stdout)
    failure = first_failure(tests, f'-{SLOW}')
    if failure:
        sys.exit('without a fault the suite fails already: ' + failure)
    missed = 0
    for number, (name, old, new, what) in enumerate(FAULTS, 1):
        if not first <= number <= last:
            continue
        path, began = os.path.join(tree, name), time.time()
        with open(path, encoding='utf-8') as file:
            text = file.read()
        if text.count(old) != 1:
            print(f'{number:2} {name}: {what}: no longer applies', flush=True)
            missed += 1
            continue
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text.replace(old, new))
        by, doubt = '', ''
        if run(command).returncode == 0:  # the compiler's refusal says nothing of the suite
            quick, rest = (SHADERS, f'-{SHADERS}') if name.startswith('glsl/') else (f'-{SHADERS}:{SLOW}', f'{SHADERS}:{SLOW}')
            by = first_failure(tests, quick)
            if not by:
                by = doubt = first_failure(tests, rest)
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text)
        if doubt and (run(command).returncode != 0 or first_failure(tests, doubt)):
            by = ''
        missed += not by
        print(f'{number:2} {name}: {what}: ' + (f'caught by {by}' if by else 'MISSED') + f' ({time.time() - began:.0f} s)', flush=True)
    print(f'{min(last, len(FAULTS)) - first + 1} faults, {missed} missed')
    sys.exit(1 if missed else 0)


if __name__ == '__main__':
    main()
