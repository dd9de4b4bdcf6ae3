"""Expressions of xacro files: those of usual descriptions as xacro itself evaluates them, all others refused, quickly and small."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from xacro_robots import XMLNS, write_files

from flexcal.errors import FlexcalError
from flexcal.export import XacroSource
from flexcal.export.xacro_expressions import Work

xacro = pytest.importorskip("xacro")

LIMITS = """joint_limits:
  shoulder: {lower: !degrees -170, upper: !degrees 2*85, effort: 330, velocity: !radians pi}
  elbow: {lower: -2.9, upper: 2.9, effort: 150.0, velocity: 3, flipped: true, note: null}
masses: [3.7, 8.05, !millimeters 2275]
common: &common {damping: 0.1, friction: 0.0}
elbow: {<<: *common, damping: 0.2}
"""
UR = """<xacro:arg name="limits" default="config/limits.yaml"/><xacro:arg name="safe" default="false"/>
<xacro:arg name="prefix" default="left_"/>
<xacro:macro name="read" params="file">
  <xacro:property name="all" value="${xacro.load_yaml(file)}" scope="parent"/>
  <xacro:property name="limits" value="${load_yaml(file)['joint_limits']}" scope="parent"/>
</xacro:macro>
<xacro:macro name="arm" params="prefix file safe:=false margin:=0.15 position:=${dict(elbow=0.0,shoulder=-1.57)} *origin">
  <xacro:read file="${file}"/>
  <xacro:property name="length" value="${all['masses'][0]/10}"/>
  <joint name="${prefix}shoulder" type="revolute">
    <xacro:insert_block name="origin"/>
    <xacro:if value="${safe}"><safety_controller soft_lower_limit="${limits['shoulder']['lower'] + margin}"/></xacro:if>
    <xacro:unless value="${safe}"><limit lower="${limits.shoulder.lower}" upper="${limits['shoulder'].upper}"/></xacro:unless>
    <dynamics damping="${all.elbow.damping}" friction="${all['elbow']['friction']}"/>
    <param name="initial">${position['shoulder']}</param>
    <inertia ixx="${0.5 * all['masses'][1] * length**2}" izz="${(1.0/12) * all.masses[-1] * (3*0.06*0.06 + length**2)}"/>
  </joint>
</xacro:macro>
<xacro:arm prefix="$(arg prefix)" file="$(arg limits)" safe="$(arg safe)">
<origin xyz="0 0 ${-0.5+2*0.25}" rpy="${pi/2} 0 ${-pi}"/>
</xacro:arm><xacro:arm prefix="" file="$(cwd)/config/limits.yaml" safe="True"><origin xyz="0 0 0"/></xacro:arm>"""
FRANKA = """<xacro:property name="values" value="${xacro.load_yaml('config/limits.yaml')}"/>
<xacro:macro name="link" params="name rpy:='0 0 0' self_collision:=false numbers:=^|{} limits:=^">
  <xacro:unless value="${rpy is None or not name}"><link name="${name}" rpy="${rpy}"/></xacro:unless>
</xacro:macro>
<xacro:macro name="robot" params="arm:='fr3' limits hand:=true connected_to:=false xyz:='0 0 1'">
  <xacro:property name="arm_prefix" value="${arm + '_' if arm != '' else ''}"/>
  <xacro:link name="${arm_prefix}link0"/><xacro:link name="${arm_prefix}link1" rpy="${pi/4} 0 0"/>
  <xacro:unless value="${not connected_to}"><joint parent="${connected_to}"/></xacro:unless>
  <limit effort="${limits['joint_limits']['elbow']['effort']}" none="${limits.joint_limits.elbow.note}" x="${xyz.split(' ')[2]}"/>
</xacro:macro>
<xacro:robot limits="${values}" connected_to="base"/><xacro:robot arm="" limits="${values}"/>"""
XARM = """<xacro:arg name="dof" default="7"/><xacro:arg name="interface" default="position"/>
<xacro:property name="dof" value="$(arg dof)"/><xacro:property name="numbers" value="${[0.1, 2, -3e-3]}"/>
<xacro:property name="mesh" value="file:///meshes/a.stl"/>
<xacro:if value="${dof == 7 and 'position' in '$(arg interface)'}"><link name="seven${dof-1}"/></xacro:if>
<xacro:if value="${dof in [5, 6] or not (dof == 7)}"><link name="fewer"/></xacro:if>
<link mesh="${mesh if mesh.startswith('file:///') or mesh.startswith('package://') else 'package://' + mesh}"/>
<xacro:property name="kind" value="${'EffortJointInterface' if dof &lt; 6 else 'VelocityJointInterface' if dof == 6 else 'Position'}"/>
<xacro:macro name="counted" params="i"><interface name="DO${i}_$(arg interface)"/>
  <xacro:if value="${i &lt; 60}"><xacro:counted i="${i + 1}"/></xacro:if></xacro:macro>
<a kind="${kind}" last="${numbers[-1]}" some="${numbers[:2]}" n="${len(numbers)}"><xacro:counted i="1"/></a>"""
KINOVA = """<xacro:include filename="parts/${'gripper' if '$(arg grip)' else 'none'}.xacro" ns="grip"/>
<xacro:include filename="parts/g*.xacro"/><xacro:include filename="parts/absent.xacro" optional="true"/>
<xacro:property name="count" value="2" lazy_eval="false"/><xacro:property name="late" value="${count * 2}"/>
<xacro:property name="count" value="21"/>
<xacro:call macro="${'finger'}" side="l"/><xacro:grip.finger side="r"/>
<xacro:property name="block"><origin xyz="1 2 3"/><b late="${late}"/></xacro:property>
<xacro:element xacro:name="${'li' + 'nk'}" name="made"><xacro:attribute name="k" value="v${grip.width}"/></xacro:element>
<j><xacro:insert_block name="block"/></j><xacro:property name="count" remove="true"/>
<xacro:property name="speed" default="0.5"/><s v="${speed}" $$="" />""".replace(
    ' $$=""', ' d="$${kept} $$(kept) 5$ "'
)
GRIPPER = """<xacro:property name="width" value="0.085"/><xacro:macro name="finger" params="side:=^|r">
<link name="${side}_finger" w="${width/2}"/></xacro:macro>"""
PAL = """<xacro:property name="deg_to_rad" value="0.017453"/><xacro:property name="eps" value="1e-2"/>
<xacro:macro name="limb" params="name side reflect:=1 has_ft:=${False} origin:='1 2'">
  <xacro:property name="suffix" value="${'' if side == '' else '_' + side}"/>
  <limit lower="${-90.0 * deg_to_rad + eps}" upper="${max(1, 2.5, 0) - min([3, 4])}"
    x="${reflect*0.03}" y="${origin}" z="${abs(-2) if False else 1}"/>
  <xacro:if value="${has_ft and not side in ['l', 'r']}"><ft/></xacro:if>
  <name full="limb${suffix}" up="${side.upper()}" round="${round(pi, 4)} ${int(3.7)} ${float('1e-3')} ${str(5) + 'x'} ${bool(0)}"/>
  <text>${sin(pi/6)} ${math.atan2(1, 2)} ${sqrt(2)**3 // 1} ${7 % 4} ${'%s_%.3f' % (name, eps)} ${2 &lt; 3 &lt;= 3} ${radians(90)}</text>
</xacro:macro>
<xacro:limb name="arm" side="l" reflect="${-1}"/><xacro:limb name="arm" side="" has_ft="true"/>
<!-- xacro:eval-comments --><!-- ${deg_to_rad} --><!-- xacro:eval-comments:off -->"""
INDUSTRIAL = """<xacro:include filename="$(find robot)/parts/gripper.xacro"/><xacro:property name="prefix" value="$(optenv SIDE r_)"/>
<xacro:property name="dotted" value="${xacro.dotify(dict(a=dict(b=[1, dict(c=2)])))}"/>
<joint name="${prefix}joint_1" type="revolute"><limit lower="${radians(-165)}" upper="${math.radians(165)}" velocity="${radians(250.0)}"/>
<axis z="${dotted.a.b[1]['c']}"
 keys="${sorted(dict(b=1, a=2).keys())}"
 got="${dict(a=1).get('z', 'no')}" joined="${'-'.join(['a', 'b'])}"/></joint>
<xacro:finger side="${prefix}"/><p value="${xacro.arg('grip')} ${xacro.tokenize('1, 2;3')[1]} ${python.sum([1, 2])}"/>"""
DESCRIPTIONS = {
    "UR": UR, "Franka": FRANKA, "xArm": XARM, "Kinova": KINOVA, "PAL": PAL, "ABB, Fanuc, KUKA": INDUSTRIAL,
}  # fmt: skip


def description(folder: Path, body: str, **more: str) -> Path:
    files = {
        "robot.xacro": f'<robot name="r" {XMLNS}><xacro:arg name="grip" default="yes"/>{body}</robot>',
        "package.xml": "<package><name>robot</name></package>",
        "parts/gripper.xacro": f"<robot {XMLNS}>{GRIPPER}</robot>",
        "config/limits.yaml": LIMITS,
    }
    write_files(folder, {**files, **more})
    return folder / "robot.xacro"


@pytest.mark.parametrize("kind", DESCRIPTIONS)
def test_usual_descriptions_expand_as_by_xacro_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    main = description(tmp_path, DESCRIPTIONS[kind])
    monkeypatch.chdir(tmp_path)
    ours = XacroSource(main, {}, {}).expand({}).text
    monkeypatch.setattr("xacro.substitution_args._eval_find", lambda name: str(tmp_path))
    assert ours == xacro.process_file(str(main), verbosity=0).toxml()


ESCAPES = [
    "().__class__", "''.__class__.__mro__", "(lambda: 1)()", "[x for x in (1,)]", "(x for x in (1,))", "(y := 1)", "__import__('os')",
    "open('/etc/passwd')", "eval('1')", "getattr(1, 'real')", "vars()", "type(1)", "str.format", "'{0.__class__}'.format(1)", "f'{1}'",
    "dict.__class__", "limits.__class__", "limits.get.__self__", "limits['a'].real", "xacro.load_yaml.__globals__", "xacro.__dict__",
    "xacro['load_yaml']", "math.__loader__", "python.type(1)", "python.vars(1)", "print_location.__code__", "__builtins__",
    "＿＿builtins__",
    "𝔩𝔦𝔪𝔦𝔱𝔰.__𝔠𝔩𝔞𝔰𝔰__", "abs", "math", "xacro", "max(*[1, 2])", "dict(**limits)", "{**limits}", "{1, 2}", "b'a'", "1j", "...",
    "(-8)**0.5", "~1", "1 << 3", "[1] @ [2]", "pi.real", "max.__name__", "'a'.join", "shape.format(1)",
    "[].append(1)", "map(str, [1])", "hidden(1)", "later",
    "'%(a)s' % limits", "'%*d' % (9, 1)", "not_there", "1 +", "", "yield", "await x", "min([], key=len)", "1 if", "limits.no", "('a',)[3]",
    "xacro.fatal('it\\u001b[31m failed')", "xacro.arg('__class__')", "xacro.load_yaml('config/tags.yaml')",
    "xacro.load_yaml('config/broken.yaml')", "xacro.load_yaml('config/set.yaml')", "xacro.load_yaml('config/loop.yaml')",
]  # fmt: skip


@pytest.mark.parametrize("expression", ESCAPES)
def test_all_else_is_refused_with_file_line_and_expression(tmp_path: Path, expression: str) -> None:
    quoted = expression.replace("&", "&amp;").replace("<", "&lt;")
    body = f"""
<xacro:property name="limits" value="${{xacro.load_yaml('config/limits.yaml')}}"/>
<xacro:property name="hidden" value="3"/><xacro:property name="shape" value="{{0.__class__}}"/>
<xacro:property name="later" value="${{abs(limits.__class__)}}"/>
<a b="${{{quoted}}}"/>"""
    main = description(
        tmp_path,
        body.replace("{**limits}}", "{**limits }}"),
        **{
            "config/tags.yaml": "a: !!python/object/apply:os.system ['true']",
            "config/broken.yaml": "a: [",
            "config/set.yaml": "a: !!set {b, c}",
            "config/loop.yaml": "a: &a [*a]",
        },
    )
    with pytest.raises(FlexcalError) as caught:
        XacroSource(main, {}, {}).expand({})
    assert caught.value.code == "E-ROS-037"
    assert f"robot.xacro line {4 if expression == 'later' else 5}: ${{" in str(caught.value)


BOMBS = {
    "power": '<a b="${9**9**9}"/>',
    "text": "<a b=\"${'a'*10**10}\"/>",
    "list": '<a b="${[[0]*1000]*10**6}"/>',
    "range": '<a b="${range(10**9)}"/>',
    "round": '<a b="${round(1, -10**9)}"/>',
    "format": "<a b=\"${'%999999999d' % 1}\"/>",
    "join": "<a b=\"${('x'*1000000).join(str(10**300).split('0'))}\"/>",
    "parentheses": f'<a b="${{{"(" * 5000}1{")" * 5000}}}"/>',
    "signs": f'<a b="${{{"-" * 9000}1}}"/>',
    "sums": f'<a b="${{1{"+1" * 4000}}}"/>',
    "digits": f'<xacro:property name="n" value="{"9" * 4000}"/><a b="${{n*n}}"/>',
    "doubled texts": "".join(
        f'<xacro:property name="p{k + 1}" value="${{p{k}}}${{p{k}}}"/>' for k in range(60)
    )
    + '<xacro:property name="p0" value="ab"/><a b="${p60}"/>',
    "doubled lists": "".join(
        f'<xacro:property name="p{k + 1}" value="${{[p{k}, p{k}]}}"/>' for k in range(60)
    )
    + '<xacro:property name="p0" value="ab"/><a b="${p60}"/>',
    "circle": '<xacro:property name="p" value="${q}"/><xacro:property name="q" value="${p}"/><a b="${p}"/>',
    "chain": "".join(f'<xacro:property name="p{k + 1}" value="${{p{k} + 1}}"/>' for k in range(3000))
    + '<xacro:property name="p0" value="1"/><a b="${p3000}"/>',
    "recursion": '<xacro:macro name="m" params=""><a><xacro:m/></a></xacro:macro><xacro:m/>',
    "doubled macros": '<xacro:macro name="m0" params=""><a/></xacro:macro>'
    + "".join(
        f'<xacro:macro name="m{k + 1}" params=""><xacro:m{k}/><xacro:m{k}/></xacro:macro>' for k in range(60)
    )
    + "<xacro:m60/>",
    "skipped copies": f'<xacro:macro name="m" params=""><xacro:if value="0">{"<a/>" * 20000}</xacro:if></xacro:macro>'
    + "<xacro:m/>" * 3000,
    "comments": f'<xacro:macro name="m" params=""><a><!--{"x" * 500_000}--></a></xacro:macro>'
    + "<xacro:m/>" * 3000,
    "many children": f'<xacro:macro name="m" params="">{"<a/>" * 1000}</xacro:macro>' + "<xacro:m/>" * 1000,
    "itself": '<xacro:include filename="robot.xacro"/>',
    "parameters": f'<xacro:macro name="m" params="a:={"x" * 40}\'"><b/></xacro:macro><xacro:m/>',
    "yaml of aliases": "<a b=\"${xacro.load_yaml('config/aliases.yaml')}\"/>",
    "yaml number": "<a b=\"${xacro.load_yaml('config/number.yaml')}\"/>",
    "entities": "",
    "deep": "<a>" * 20_000 + "</a>" * 20_000,
    "elements": "<a/>" * 150_000,
    "newlines": "\n" * 6_000_000,
}
ALIASES = "a0: &a0 [1, 2]\n" + "".join(f"a{k + 1}: &a{k + 1} [*a{k}, *a{k}]\n" for k in range(60))


@pytest.mark.parametrize("kind", BOMBS)
def test_work_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    monkeypatch.setattr(Work, "SINGLE", 100_000)
    main = description(
        tmp_path,
        BOMBS[kind],
        **{
            "config/aliases.yaml": ALIASES,
            "config/number.yaml": f"n: 1{':1' * 200_000}",
        },
    )
    if kind == "entities":
        doubled = "".join(f'<!ENTITY e{k + 1} "&e{k};&e{k};">' for k in range(40))
        main.write_text(
            f'<!DOCTYPE r [<!ENTITY e0 "x">{doubled}]><robot {XMLNS} name="r"><a b="&e40;"/></robot>'
        )
    started = time.process_time()
    with pytest.raises(FlexcalError):
        XacroSource(main, {}, {}).expand({})
    assert time.process_time() - started < 10
