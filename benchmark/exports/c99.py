"""A step form in C99: the subset of Python in which step forms are written, translated statement by statement."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass, field

# What parameters without an annotation are: those of the effects' laws.
USUAL = {"p": "list", "m": "list", "i": "int", "j": "int", "k": "int"}
BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%", ast.FloorDiv: "/"}
# A sample count times the substeps of 10 kHz fills an int within a day.
C_TYPES = {"double": "double", "int": "long long"}
COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
CALLS = {"abs": "fabs", "min": "smaller", "max": "larger", "round": "rint"}
PREAMBLE = """\
static inline double smaller(double a, double b) { return b < a ? b : a; }
static inline double larger(double a, double b) { return b > a ? b : a; }
"""


@dataclass
class Signature:
    """The C types of a function: "double", "int", or "list", an array; `written` are the arrays that it changes."""

    kinds: list[str]
    returns: str
    written: list[bool] = field(default_factory=list)


def translate(source: str, constants: Sequence[str]) -> str:
    """Translate functions of a step form to C99. Raises ValueError for what the subset does not have."""
    known: dict[str, Signature] = {}
    texts = []
    for function in ast.parse(source).body:
        if not isinstance(function, ast.FunctionDef):
            raise ValueError(f"line {function.lineno}: a step form has functions only")
        texts.append(_Function(function, known, constants).text())
    return "\n".join(texts)


class _Function:
    """One function on its way to C."""

    def __init__(self, node: ast.FunctionDef, known: dict[str, Signature], constants: Sequence[str]) -> None:
        self.node, self.known = node, known
        self.arguments = [argument.arg for argument in node.args.args]
        kinds = [self._kind_of_argument(argument) for argument in node.args.args]
        self.kinds: dict[str, str] = dict.fromkeys(constants, "list") | dict(zip(self.arguments, kinds, strict=True))
        self.arrays: dict[str, int] = {}
        self.changed: set[str] = set()
        values = [n for n in ast.walk(node) if isinstance(n, ast.Return) and n.value is not None]
        self.signature = Signature(kinds, "double" if values else "void")

    def text(self) -> str:
        body = self.node.body
        document = ast.get_docstring(self.node)
        lines = self._block(body[1:] if document else body, 1)
        locals_ = [name for name in self.kinds if name not in self.arguments and name.islower()]
        self.signature.written = [name in self.changed for name in self.arguments]
        self.known[self.node.name] = self.signature
        declared = [
            f"    double {name}[{self.arrays[name]}] = {{0.0}};" if name in self.arrays
            else f"    {C_TYPES[self.kinds[name]]} {name} = 0;" for name in locals_
        ]  # fmt: skip
        arguments = ", ".join(
            f"{'' if name in self.changed else 'const '}double *{name}" if kind == "list" else f"{C_TYPES[kind]} {name}"
            for name, kind in zip(self.arguments, self.signature.kinds, strict=True)
        )
        comment = [f"/* {document.replace('*/', '* /')} */"] if document else []
        unused = [f"    (void){name};" for name in self.arguments if not self._used(name)]
        head = f"static {self.signature.returns} {self.node.name}({arguments})"
        return "\n".join([*comment, f"{head} {{", *declared, *unused, *lines, "}", ""])

    def _used(self, name: str) -> bool:
        return any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(self.node))

    @staticmethod
    def _kind_of_argument(argument: ast.arg) -> str:
        if isinstance(argument.annotation, ast.Name):
            return {"list": "list", "int": "int", "float": "double"}[argument.annotation.id]
        return USUAL.get(argument.arg, "double")

    def _block(self, body: Sequence[ast.stmt], depth: int) -> list[str]:
        return [line for statement in body for line in self._statement(statement, depth)]

    def _statement(self, node: ast.stmt, depth: int) -> list[str]:  # noqa: PLR0911 - one case for each
        pad = "    " * depth
        match node:
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)):
                held = [f"{name}_{i}" for i, name in enumerate(["held"] * len(values))]
                self.kinds |= {name: self._kind(value) for name, value in zip(held, values, strict=True)}
                first = [f"{pad}{name} = {self._value(value)};" for name, value in zip(held, values, strict=True)]
                for target, name in zip(targets, held, strict=True):
                    self._declare(target, self.kinds[name])
                return first + [f"{pad}{self._value(t)} = {name};" for t, name in zip(targets, held, strict=True)]
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.BinOp(left=ast.List(), right=ast.Constant(value=n))):
                assert isinstance(n, int)
                self.kinds[name], self.arrays[name] = "list", n
                return []
            case ast.Assign(targets=[target], value=value):
                self._declare(target, self._kind(value))
                return [f"{pad}{self._value(target)} = {self._value(value)};"]
            case ast.AugAssign(target=target, op=op, value=value):
                self._declare(target, self._kind(value))
                return [f"{pad}{self._value(target)} {BINARY[type(op)]}= {self._value(value)};"]
            case ast.For(target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=bounds), body=body):
                self.kinds[name] = "int"
                low, high = (["0"] if len(bounds) == 1 else []) + [self._value(bound) for bound in bounds]
                head = f"{pad}for ({name} = {low}; {name} < {high}; {name}++) {{"
                return [head, *self._block(body, depth + 1), f"{pad}}}"]
            case ast.If(test=test, body=body, orelse=other):
                lines = [f"{pad}if ({self._value(test)}) {{", *self._block(body, depth + 1)]
                return lines + ([f"{pad}}} else {{", *self._block(other, depth + 1)] if other else []) + [f"{pad}}}"]
            case ast.Expr(value=value):
                return [f"{pad}{self._value(value)};"]
            case ast.Return(value=value):
                return [f"{pad}return {self._value(value)};" if value else f"{pad}return;"]
        raise ValueError(f"line {node.lineno}: a step form has no {type(node).__name__} like this one")

    def _declare(self, target: ast.expr, kind: str) -> None:
        match target:
            case ast.Name(id=name):
                self.kinds.setdefault(name, kind)
            case ast.Subscript(value=ast.Name(id=name)):
                self.changed.add(name)

    def _kind(self, node: ast.expr) -> str:  # noqa: PLR0911
        """Tell whether an expression is a whole number or any."""
        match node:
            case ast.Constant(value=value):
                return "int" if isinstance(value, int) else "double"
            case ast.Name(id=name):
                return self.kinds[name]
            case ast.BinOp(left=left, op=op, right=right) if not isinstance(op, ast.Div):
                return "int" if self._kind(left) == self._kind(right) == "int" else "double"
            case ast.UnaryOp(operand=operand):
                return self._kind(operand)
            case ast.IfExp(body=body, orelse=other):
                return "int" if self._kind(body) == self._kind(other) == "int" else "double"
            case ast.Call(func=ast.Name(id="int")):
                return "int"
        return "double"

    def _value(self, node: ast.expr) -> str:  # noqa: PLR0911 - one line for each kind of expression
        match node:
            case ast.Constant(value=value) if isinstance(value, int | float):
                return repr(value)
            case ast.Name(id=name):
                if name not in self.kinds:
                    raise ValueError(f"line {node.lineno}: {name} has no value")
                return name
            case ast.Subscript(value=ast.Name(id=name), slice=index):
                return f"{name}[{self._value(index)}]"
            case ast.BinOp(left=left, op=op, right=right):
                whole = isinstance(op, ast.Div) and self._kind(left) == self._kind(right) == "int"
                return f"({'(double)' * whole}{self._value(left)} {BINARY[type(op)]} {self._value(right)})"
            case ast.UnaryOp(op=op, operand=operand):
                return f"({'!' if isinstance(op, ast.Not) else '-'}{self._value(operand)})"
            case ast.BoolOp(op=op, values=values):
                return f"({(' && ' if isinstance(op, ast.And) else ' || ').join(map(self._value, values))})"
            case ast.Compare(left=left, ops=ops, comparators=others):
                pairs = zip([left, *others[:-1]], ops, others, strict=True)
                parts = [f"{self._value(a)} {COMPARE[type(op)]} {self._value(b)}" for a, op, b in pairs]
                return f"({' && '.join(parts)})"
            case ast.IfExp(test=test, body=body, orelse=other):
                return f"({self._value(test)} ? {self._value(body)} : {self._value(other)})"
            case ast.Call():
                return self._call(node)
        raise ValueError(f"line {node.lineno}: a step form has no {type(node).__name__} like this one")

    def _call(self, node: ast.Call) -> str:
        arguments = [self._value(argument) for argument in node.args]
        match node.func:
            case ast.Attribute(value=ast.Name(id="math"), attr=name):
                return f"{name}({', '.join(arguments)})"
            case ast.Name(id="int"):
                return f"(long long){arguments[0]}"
            case ast.Name(id="float"):
                return f"(double){arguments[0]}"
            case ast.Name(id="min" | "max" as name) if len(arguments) == 2:
                return f"{CALLS[name]}({', '.join(arguments)})"
            case ast.Name(id="abs" | "round" as name):
                return f"{CALLS[name]}({', '.join(arguments)})"
            case ast.Name(id=name) if name in self.known:
                for argument, written in zip(arguments, self.known[name].written, strict=True):
                    if written:
                        self.changed.add(argument)
                return f"{name}({', '.join(arguments)})"
        raise ValueError(f"line {node.lineno}: a step form knows no function {ast.unparse(node.func)}")
