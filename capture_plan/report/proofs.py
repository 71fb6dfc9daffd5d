"""What a plan has proved, in words; nothing is called proved without a certificate that anybody can check."""

from capture_plan.plan.record import Plan
from capture_plan.plan.summary import fine_words
from capture_plan.prose import count

ORDERED = {
    "early": "In no other order, but for what an edit locks, do the first of these expressions cover more.",
    "minimum": "Each expression is proved the most important one possible after those before it, of those that keep "
    "the list shortest.",
    "sequential": "Each expression is proved the most important one possible after those before it.",
}


def minimum_proof(plan: Plan) -> str:
    """What is proved about the number of landmarks; empty where nothing is."""
    least = plan.layout.certificate.landmarks
    return (
        f"Proved: under these constraints fewer than {least} cannot show every blendshape even once"
        if least > 1
        else ""
    )


def packing_proof(plan: Plan) -> str:
    """What is proved about the number of expressions; empty where nothing is."""
    packing = plan.packing
    cut = len(packing.expressions) < packing.objective
    shown = f"{len(packing.expressions)} of {packing.objective} are shown. " if cut else ""
    if packing.proven_optimal and packing.bound == packing.objective:
        return f"{shown}Proved: fewer than {packing.bound} cannot show every blendshape"
    return f"{shown}Proved: at least {packing.bound} are needed to show every blendshape" if packing.bound > 1 else ""


def proofs(plan: Plan) -> list[str]:
    """The proofs in whole sentences, with what anybody can check by hand."""
    return [*landmark_proofs(plan), *expression_proofs(plan)]


def landmark_proofs(plan: Plan) -> list[str]:
    """What was proved about the landmarks, in sentences."""
    layout, certificate, said = plan.layout, plan.layout.certificate, []
    if minimum := minimum_proof(plan):
        check = f" Prices in plan.json show without a solver that at least {certificate.landmarks} are needed."
        said.append(f"{minimum}.{check if certificate.blendshapes else ''}")
    chose = any(m.round is not None for m in layout.landmarks)
    if chose and layout.programs and all(program.proven_optimal for program in layout.programs):
        chose_them = f"{count(len(layout.programs), 'program')} chose markers"
        said.append(f"{chose_them}; that no cheaper choice exists is the solver's word, which nobody can check here.")
    return [*said, *fine_words(plan)]


def expression_proofs(plan: Plan) -> list[str]:
    """What was proved about the list of expressions, in sentences."""
    packing, said = plan.packing, []
    if proof := packing_proof(plan):
        clique = f" No two of these fit into one expression: {', '.join(packing.clique)}."
        said.append(f"{proof}.{clique if len(packing.clique) > 1 else ''}")
    if packing.order_proven and packing.method in ORDERED:
        said.append(ORDERED[packing.method])
    return said
