"""Arrays of structs, arrays in arrays, members that are arrays: beside the originals on OpenGL, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from original import Original, original

import passgraph as pg
from passgraph.glsl.shader import parse
from passgraph.graph.calls import PixelKernel
from passgraph.language.types import Array, Matrix, Scalar, Struct, Type, Vector, shape_of

LIGHT = "struct Light { vec3 position; float gain; };\n"
HEAD = "#version 430\n#define gl_FragColor shown_color\nout vec4 shown_color;\n"
SIZE = (8, 3)
#: Those that a compiled backend runs too; what the representation means there has tests of its own.
COMPILED = ("in, out and inout", "many", "structs with arrays of structs", "swap by index")
#: What each is about, and its text; LIGHT goes before.
SHADERS = {
    "uniforms by index": """
uniform Light lights[3]; void main(){ int i=int(gl_FragCoord.x)%4;
gl_FragColor=vec4(lights[i%3].position, lights[i%3].gain); }
""",
    "members of local elements": """
void main(){ Light a[3]; for(int i=0;i<3;i++){ a[i].position=vec3(float(i),2.0,3.0);
a[i].gain=float(i)*0.5; a[i].position.y += float(i);} a[1].position.xz = vec2(9.0,8.0);
int k=int(gl_FragCoord.x)%3; gl_FragColor=vec4(a[k].position,a[k].gain);
}
""",
    "arrays of arrays": """
void main(){ float g[2][3]; for(int i=0;i<2;i++) for(int j=0;j<3;j++) g[i][j]=float(10*i+j);
int x=int(gl_FragCoord.x); g[x%2][x%3] *= 2.0; float r[3] = g[x%2];
r[0]+=100.0; gl_FragColor=vec4(r[0],r[1],g[1][2],g[0][0]); }
""",
    "members that are arrays": """
struct S { float w[3]; vec2 p[2]; }; void main(){ S s[2]; for(int i=0;i<2;i++){
for(int j=0;j<3;j++) s[i].w[j]=float(i*3+j); s[i].p[0]=vec2(1.0,float(i));
s[i].p[1]=s[i].p[0]*2.0;} int x=int(gl_FragCoord.x); s[x%2].w[x%3]+=7.0;
s[x%2].p[1].y -= 0.5; gl_FragColor=vec4(s[0].w[x%3], s[1].w[2], s[x%2].p[1]);
}
""",
    "in, out and inout": """
void f(inout Light l, float k){ l.position*=k; l.gain+=1.0;} void g(out Light l[2]){
l[0]=Light(vec3(1.0),2.0); l[1]=l[0]; l[1].gain=5.0; } float h(Light l[2], int i){
l[i].gain*=2.0; return l[0].gain+l[1].gain; } void main(){ Light a[2];
g(a); int x=int(gl_FragCoord.x)%2; f(a[x],3.0); float s=h(a,x);
gl_FragColor=vec4(a[0].position.x,a[1].position.y,s,a[x].gain);
}
""",
    "constructors and equality": """
void main(){ Light a[2] = Light[2](Light(vec3(1.0,2.0,3.0),4.0), Light(vec3(gl_FragCoord.x),6.0));
Light b[2]; b = a; b[1].gain += 1.0; bool same = a == b;
gl_FragColor=vec4(b[1].position.x, b[1].gain, a[1].gain, same?1.0:0.0);
}
""",
    "arrays of arrays inout": """
void f(inout float g[2][3], int i){ g[i][2] = 9.0; } void main(){
float g[2][3]; for(int i=0;i<2;i++) for(int j=0;j<3;j++) g[i][j]=float(i+j);
f(g, int(gl_FragCoord.x)%2); gl_FragColor=vec4(g[0][2],g[1][2],g[0][1],float(g.length()*10+g[0].length()));
}
""",
    "an element inout": """
void f(inout float v){ v+=1.0;} void main(){ float g[2][3];
for(int i=0;i<2;i++) for(int j=0;j<3;j++) g[i][j]=float(i+j);
int x=int(gl_FragCoord.x); f(g[x%2][x%3]); gl_FragColor=vec4(g[0][0],g[0][1],g[1][0],g[1][2]);
}
""",
    "uniform structs with structs and matrices": """
struct A { float v; vec2 q; }; struct B { A a[2]; mat2 m; }; uniform B bs[2];
void main(){ B b = bs[int(gl_FragCoord.x)%2]; b.a[1].v += 1.0;
b.m[0] = b.a[0].q; gl_FragColor = vec4(b.a[0].v, b.a[1].v, b.m[0].y, b.m[1].x + bs[1].a[1].q.x);
}
""",
    "results": """
Light[2] mk(float k){ Light r[2]; r[0]=Light(vec3(k),k); r[1]=Light(vec3(2.0*k),3.0*k);
return r; } void main(){ gl_FragColor=vec4(mk(gl_FragCoord.x)[1].position.x, mk(2.0)[0].gain, mk(1.0).length(), 1.0);
}
""",
    "two elements inout": """
void swap(inout Light a, inout Light b){ Light t=a; a=b; b=t;
} void main(){ Light a[2]; a[0]=Light(vec3(1.0),2.0); a[1]=Light(vec3(gl_FragCoord.x),4.0);
swap(a[0],a[1]); gl_FragColor=vec4(a[0].position.x,a[0].gain,a[1].position.x,a[1].gain);
}
""",
    "constants": """
const Light T[2] = Light[2](Light(vec3(1.0,2.0,3.0),4.0), Light(vec3(5.0),6.0));
void main(){ Light l = T[int(gl_FragCoord.x)%2]; gl_FragColor=vec4(l.position, l.gain + T[1].gain);
}
""",
    "globals": """
Light a[2]; void set(int i){ a[i].gain = 3.0; a[i].position[1] = 7.0;
} void main(){ a[0]=Light(vec3(0.0),0.0); a[1]=a[0]; set(int(gl_FragCoord.x)%2);
gl_FragColor=vec4(a[0].gain,a[1].gain,a[0].position.y,a[1].position.y);
}
""",
    "structs with arrays of structs": """
struct W { Light l; Light ls[2]; }; void main(){ W w[2]; for(int i=0;i<2;i++){
w[i].l=Light(vec3(float(i)),1.0); w[i].ls[0]=w[i].l; w[i].ls[1]=w[i].l;
} int x=int(gl_FragCoord.x)%2; w[x].ls[1].position.z=5.0; w[x].l.gain++;
gl_FragColor=vec4(w[0].ls[1].position.z,w[1].ls[1].position.z,w[0].l.gain,w[1].l.gain);
}
""",
    "uniform arrays as arguments": """
uniform Light lights[2]; float total(Light l[2]){ float s=0.0;
for(int i=0;i<l.length();i++) s+=l[i].gain*l[i].position.y; return s;
} void main(){ gl_FragColor=vec4(total(lights)); }
""",
    "a choice between elements": """
uniform Light lights[2]; void main(){ Light l = gl_FragCoord.x > 3.0 ? lights[0] : lights[1];
gl_FragColor=vec4(l.position,l.gain); }
""",
    "lists in braces": """
struct P { vec2 a; float b; }; void main(){ P p[2] = { {vec2(1.0,2.0), 3.0}
, {vec2(gl_FragCoord.x), 6.0} }; gl_FragColor=vec4(p[1].a, p[0].b, p[1].b);
}
""",
    "uniform arrays of arrays": """
uniform float g[2][3]; void main(){ int x=int(gl_FragCoord.x);
gl_FragColor=vec4(g[x%2][x%3], g[1][2], g[0][1], 1.0); }
""",
    "aos of aos": """
void main(){ Light l[2][3];
for(int i=0;i<2;i++) for(int j=0;j<3;j++) l[i][j]=Light(vec3(float(i),float(j),1.0),float(i*j));
int x=int(gl_FragCoord.x); l[x%2][x%3].position.zx += vec2(2.0,3.0);
Light r[3]=l[x%2]; gl_FragColor=vec4(r[x%3].position.zx, l[1][2].gain, r[2].position.y);
}
""",
    "type order": """
void main(){ Light[2] a; float[2][3] g; float[3] h[2]; for(int i=0;i<2;i++) for(int j=0;j<3;j++){
g[i][j]=float(i*3+j); h[i][j]=g[i][j]*2.0;} a[0].gain=1.0; a[1]=a[0];
gl_FragColor=vec4(g[1][2],h[1][2],float(g.length()+10*h.length()+100*g[0].length()), a[1].gain);
}
""",
    "open length": """
void main(){ Light a[]=Light[](Light(vec3(1.0),2.0),Light(vec3(gl_FragCoord.x),4.0));
float w[]=float[](1.0,2.0,3.0); gl_FragColor=vec4(a[1].position.x,a[0].gain,w[2],float(a.length()+w.length()));
}
""",
    "declared with": """
struct L { vec2 p; float r[2]; } g[2]; void main(){ g[0].p=vec2(1.0,2.0);
g[1].r[int(gl_FragCoord.x)%2]=5.0; gl_FragColor=vec4(g[0].p,g[1].r[0],g[1].r[1]);
}
""",
    "member inout": """
struct S { float w[3]; vec2 p; }; void f(inout float w[3], int i){
w[i]+=10.0; w[0]+=1.0; } void g(inout vec2 p){ p=p.yx+1.0; } void h(out float a, out float b){
a=3.0; b=4.0; } void main(){ S s[2]; for(int i=0;i<2;i++){ for(int j=0;j<3;j++) s[i].w[j]=float(i*3+j);
s[i].p=vec2(float(i),5.0);} int x=int(gl_FragCoord.x); f(s[x%2].w,x%3);
g(s[x%2].p); h(s[1].w[1], s[0].p.y); gl_FragColor=vec4(s[x%2].w[x%3],s[0].w[0],s[1].w[1],s[x%2].p.x);
}
""",
    "many": """
struct S { vec4 a; vec4 b[3]; }; void main(){ S s[12]; for(int i=0;i<12;i++){
s[i].a=vec4(float(i)); for(int j=0;j<3;j++) s[i].b[j]=vec4(float(i),float(j),0.0,1.0);
} int x=int(gl_FragCoord.x); s[x].b[x%3].z=9.0; s[x+1]=s[x]; s[x].a*=2.0;
gl_FragColor=s[x].a+s[x+1].b[x%3]; }
""",
    "element of result": """
Light[2] mk(float k){ return Light[2](Light(vec3(k),k),Light(vec3(k+1.0),k*2.0));
} void main(){ int x=int(gl_FragCoord.x)%2;
gl_FragColor=vec4(mk(3.0)[x].position.xy, mk(4.0)[1-x].gain, (mk(2.0))[x].position[1]);
}
""",
    "member equality": """
struct S { float w[2]; ivec2 q; }; void main(){ S a[2]; a[0]=S(float[2](1.0,2.0),ivec2(3,4));
a[1]=a[0]; bool e=a[0]==a[1]; a[1].w[int(gl_FragCoord.x)%2]+=float(int(gl_FragCoord.x)/4);
bool n=a[0]!=a[1]; gl_FragColor=vec4(e?1.0:0.0,n?1.0:0.0,a[1].w[0],a[1].w[1]);
}
""",
    "compound": """
void main(){ Light a[2]; a[0]=Light(vec3(1.0,2.0,3.0),4.0); a[1]=a[0]; a[1].gain=9.0;
int x=int(gl_FragCoord.x)%2; a[x].gain++; --a[x].position.y; a[x].position*=mat3(2.0);
float k=a[1-x].gain-- + (a[x].gain+=2.0); gl_FragColor=vec4(a[x].position.y,a[1-x].gain,a[x].gain,k);
}
""",
    "uniform block": """
uniform Light one; uniform struct M { float k[2]; } ms[2]; void main(){
gl_FragColor=vec4(one.position.xy, ms[int(gl_FragCoord.x)%2].k[1], one.gain+ms[0].k[0]);
}
""",
    "matrix member": """
struct S { mat3 m[2]; mat2x3 n; }; void main(){ S s[2]; for(int i=0;i<2;i++){
s[i].m[0]=mat3(float(i+1)); s[i].m[1]=s[i].m[0]*2.0; s[i].n=mat2x3(1.0);
} int x=int(gl_FragCoord.x); s[x%2].m[x%2][1][2]=7.0; s[x%2].n[1].yz=vec2(3.0,4.0);
vec3 v=s[x%2].m[x%2]*vec3(1.0,2.0,3.0); gl_FragColor=vec4(v, s[0].n[1].z+s[1].m[1][1][2]);
}
""",
    "loop jumps": """
void main(){ Light a[4]; for(int i=0;i<4;i++){ a[i]=Light(vec3(float(i)),0.0);
if(i==int(gl_FragCoord.x)) break; a[i].gain=5.0; if(i==1) continue;
a[i].position.x+=10.0;} int x=int(gl_FragCoord.x);
gl_FragColor=vec4(a[0].position.x,a[1].position.x,a[2].gain,a[0].gain);
}
""",
    "shadowing": """
Light a[2]; float f(Light a[2]){ a[0].gain=9.0; { Light a[1];
a[0].gain=1.0; } return a[0].gain; } void main(){ a[0].gain=2.0;
a[1].gain=3.0; float r=f(a); gl_FragColor=vec4(a[0].gain,a[1].gain,r,1.0);
}
""",
    "overload": """
float f(Light l){return 1.0;} float f(Light l[2]){return 2.0;
} float f(float g[2][3]){return 3.0;} float f(float g[3]){return 4.0;
} void main(){ Light a[2]; a[0].gain=0.0; a[1]=a[0]; float g[2][3];
g[0]=float[3](1.0,2.0,3.0); g[1]=g[0]; gl_FragColor=vec4(f(a),f(a[0]),f(g),f(g[1]));
}
""",
    "const index": """
const int N=3; void main(){ Light a[N*2-3]; a[N-1].gain=4.0; a[0].gain=1.0;
a[1]=a[0]; const float w[3]=float[3](1.0,2.0,3.0); float q[int(w[1])];
q[0]=1.0; q[1]=w[2]; gl_FragColor=vec4(a[2].gain,float(a.length()),q[1],float(q.length()));
}
""",
    "two by one call": """
void f(inout Light a, in Light b, out float c){ a.gain+=b.gain;
c=a.gain; a.position=b.position.zyx; } void main(){ Light a[2];
a[0]=Light(vec3(1.0,2.0,3.0),4.0); a[1]=Light(vec3(5.0,6.0,7.0),8.0);
int x=int(gl_FragCoord.x)%2; float c; f(a[x],a[1-x],c);
gl_FragColor=vec4(a[0].position.x,a[1].position.z,c,a[x].gain);
}
""",
    "struct of aoa": """
struct S { float g[2][3]; }; uniform S s[2]; void main(){ int x=int(gl_FragCoord.x);
S t=s[x%2]; t.g[x%2][x%3]+=100.0; float r[3]=t.g[x%2];
gl_FragColor=vec4(r[x%3],t.g[0][1],s[1].g[1][2],s[x%2].g[1][0]);
}
""",
    "array of bools": """
struct S { bool on[2]; ivec3 k; uint u; }; void main(){ S s[2];
for(int i=0;i<2;i++){ s[i].on[0]=i==1; s[i].on[1]=!s[i].on[0];
s[i].k=ivec3(i,-i,7); s[i].u=uint(i)-1u;} int x=int(gl_FragCoord.x)%2;
s[x].on[x]=!s[x].on[x];
gl_FragColor=vec4(s[x].on[x]?1.0:0.0, float(s[x].k.y), float(s[x].u>>8), s[1-x].on[0]?1.0:0.0);
}
""",
    "const struct array in function": """
float pick(int i){ const Light T[2]=Light[2](Light(vec3(1.0,2.0,3.0),4.0),Light(vec3(5.0),8.0));
return T[i].gain+T[1-i].position.z; } void main(){ gl_FragColor=vec4(pick(int(gl_FragCoord.x)%2));
}
""",
    "ternary elements": """
void main(){ Light a[2]; a[0]=Light(vec3(1.0),2.0); a[1]=Light(vec3(3.0),4.0);
int x=int(gl_FragCoord.x)%2; Light l=x==0?a[x]:a[0]; float w[2]=x==1?float[2](1.0,2.0):float[2](3.0,4.0);
gl_FragColor=vec4(l.position.x,l.gain,w[0],w[x]); }
""",
    "swap by index": """
void main(){ Light a[4]; for(int i=0;i<4;i++) a[i]=Light(vec3(float(i)),mod(float(i)*7.0+gl_FragCoord.x,5.0));
for(int i=0;i<3;i++) for(int j=0;j<3-i;j++) if(a[j].gain>a[j+1].gain){
Light t=a[j]; a[j]=a[j+1]; a[j+1]=t; } gl_FragColor=vec4(a[0].gain,a[3].gain,a[1].position.x,a[2].position.x);
}
""",
}


@pytest.fixture(scope="module")
def there() -> Iterator[Original]:
    with original() as made:
        yield made


def made_up(type_: Type, rng: np.random.Generator) -> Any:
    """A value of small whole numbers, so that sums and products are exact."""
    if isinstance(type_, Struct):
        return SimpleNamespace(**{name: made_up(inner, rng) for name, inner in type_.fields})
    if isinstance(type_, Array):
        return [made_up(type_.element, rng) for _ in range(type_.length)]
    numbers = rng.integers(-9, 9, shape_of(type_)).astype(np.float32)
    return numbers if numbers.ndim else float(numbers)


def leaves(name: str, type_: Type, value: Any) -> Iterator[tuple[str, Any]]:
    """What moderngl sets, by the name that OpenGL gives it: arrays of scalars whole, all else one by one."""
    if isinstance(type_, Struct):
        for field, inner in type_.fields:
            yield from leaves(f"{name}.{field}", inner, getattr(value, field))
    elif isinstance(type_, Array) and not isinstance(type_.element, Scalar):
        for i, entry in enumerate(value):
            yield from leaves(f"{name}[{i}]", type_.element, entry)
    elif isinstance(type_, Matrix):
        yield name, tuple(np.asarray(value).T.ravel().tolist())
    else:
        yield name, tuple(value.tolist()) if isinstance(type_, Vector) else value


@pytest.mark.sampled
@pytest.mark.parametrize("name", list(SHADERS))
def test_composites_mean_what_they_mean_on_opengl(name: str, there: Original) -> None:
    text, rng = LIGHT + SHADERS[name], np.random.default_rng(3)
    program = parse(text).program
    values = {p.name: made_up(p.type, rng) for p in program.parameters}
    given = dict(leaf for p in program.parameters for leaf in leaves(p.name, p.type, values[p.name]))
    expected = there.run(text, SIZE, {}, given, head=HEAD)
    assert np.ptp(expected, axis=(0, 1)).any() or not text.count("gl_FragCoord")
    target = PixelKernel.of_program(program)(**values, into=pg.target("out", "rgba32f"))
    for backend in ("reference", "numpy") if name in COMPILED else ("reference",):
        with pg.compile(target, backend=backend, size=SIZE) as run:
            assert np.array_equal(run()["out"], expected)
