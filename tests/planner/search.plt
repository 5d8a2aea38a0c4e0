:- use_module(library(plunit)).
:- use_module(library(assoc)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(outlook)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(travel)).
:- use_module(planner_golog(search)).

% Two robots of the same kind; Fast takes 10, Slow 100; Fill makes full what Empty needs and unmakes.

yard :-
    load_facts(
        [ kind(y, r1, 'Robot'), kind(y, r2, 'Robot'), kind(y, b1, 'Box'), kind(y, b2, 'Box'),
          fluent(y, heavy, b1, true), fluent(y, heavy, b2, true),
          agent(y, 'Fast'(R1), R1), duration(y, 'Fast'(_), fixed(10)),
          agent(y, 'Slow'(R2), R2), duration(y, 'Slow'(_), fixed(100)),
          agent(y, 'Fill'(R3), R3), duration(y, 'Fill'(_), fixed(10)), effect(y, 'Fill'(_), fluent(full, tank), true),
          agent(y, 'Empty'(R4), R4), duration(y, 'Empty'(_), fixed(10)), effect(y, 'Empty'(_), fluent(full, tank), false),
          precondition(y, 'Empty'(_), holds(full, tank, true)),
          agent(y, 'Use'(R7), R7), duration(y, 'Use'(_), fixed(10)),
          precondition(y, 'Use'(_), not(holds(full, tank, true))),
          agent(y, 'Lighten'(R5, _), R5), duration(y, 'Lighten'(_, _), fixed(10)),
          effect(y, 'Lighten'(_, X5), fluent(heavy, X5), false),
          agent(y, 'Move'(R6, _), R6), duration(y, 'Move'(_, _), fixed(1000))
        ], _).

yard_gone :- drop_facts(y, _).

looking(S) :- looking(2, S).
looking(Limit, S) :- no_travel(Travel), situation(y, plan(Travel), Limit, 0, S).

best(P, Result) :- looking(S), best_plan(P, S, 10_000, Result).

:- begin_tests(best_plan, [setup(yard), cleanup(yard_gone)]).

test('nothing takes no time', R == plan(optimal, 0, 0, [], [], 0-0)) :- best([], R).
test('the shorter branch is taken', M == 10) :-
    best(choice(f, c, [call(f, a, 'Slow'(r1)), call(f, b, 'Fast'(r1))]), plan(optimal, M, M, _, [], _)).
test('different robots work at once', M == 100) :-
    best(conc([call(f, a, 'Slow'(r1)), call(f, b, 'Slow'(r2))]), plan(optimal, M, M, _, [], _)).
test('one robot alone does one after the other', M == 200) :-
    looking(1, S), P = pick(f, p, R, 'Robot', conc([call(f, a, 'Slow'(R)), call(f, b, 'Slow'(R))])),
    best_plan(P, S, 10_000, plan(optimal, M, M, _, [], _)).
test('of plans that take as long, the one with less work', Started == ['f/a', 'f/d']) :-
    best(conc([call(f, a, 'Slow'(r1)), choice(f, c, [call(f, b, 'Slow'(r2)), call(f, d, 'Fast'(r2))])]),
         plan(optimal, 100, 100, Events, [], _)),
    findall(Id, member(started(Id, _, _, _, _), Events), Started).
test('what none may do is proven to be unsolvable', R = none(proven, _)) :-
    best(choice(f, c, []), R).
test('a test that never holds is proven to be unsolvable', R = none(proven, _)) :-
    best([call(f, a, 'Fast'(r1)), test(holds(full, tank, true))], R).
test('a branch with nothing to do is taken where it is enough', Chosen == 1) :-
    best(choice(f, c, [[], call(f, a, 'Slow'(r1))]), plan(optimal, 0, 0, Events, [], _)),
    memberchk(chose('f/c', Chosen), Events).
test('a branch is not taken as done where what follows needs the other', M == 20) :-
    best([choice(f, c, [[], call(f, a, 'Fill'(r1))]), call(f, b, 'Empty'(r1))], plan(optimal, M, M, _, [], _)).
test('a step waits for what it needs', M == 20) :-
    best(conc([call(f, a, 'Empty'(r1)), call(f, b, 'Fill'(r2))]), plan(optimal, M, M, _, [], _)).
test('waiting pays where a step would undo what another needs', M == 110) :-
    best(conc([call(f, a, 'Empty'(r1)), call(f, b, 'Fill'(r2)),
               [call(f, d, 'Slow'(r2)), test(holds(full, tank, false))]]),
         plan(optimal, M, M, _, [], _)).
test('a step that would spoil what another needs is put off', M == 110) :-
    best(conc([call(f, a, 'Fill'(r1)), [call(f, b, 'Slow'(r2)), call(f, d, 'Use'(r2))]]), plan(optimal, M, M, _, [], _)).
test('a loop on what is known is looked through', M == 20) :-
    best([call(f, a, 'Fill'(r1)), while(holds(full, tank, true), call(f, b, 'Empty'(r1)))], plan(optimal, M, M, _, [], _)).
test('a plan goes as far as what only acting finds out', M-Waits == 10-[loc(f, on)]) :-
    best([call(f, b, 'Fast'(r1)), while(is_true(loc(f, on)), call(f, a, 'Fast'(r1))), call(f, d, 'Slow'(r1))],
         plan(optimal, M, M, _, Waits, _)).
test('turns that fall away do not count', M == 10) :-
    best([call(f, a, 'Lighten'(r1, b1)),
          foreach(f, e, [X-'Box'], all([holds(heavy, X, true), not(holds(heavy, b2, false))]), I,
                  choice(I, c, [call(I, m, 'Move'(r1, X)), []]))],
         plan(optimal, M, M, _, [], _)).
test('the bound is right though turns may fall away', M == 20) :-
    best([call(f, a, 'Lighten'(r1, b1)), call(f, b, 'Lighten'(r1, b2)),
          foreach(f, e, [X-'Box'], holds(heavy, X, true), I, call(I, m, 'Move'(r1, X)))],
         plan(optimal, M, M, _, [], _)).
test('nor does the bound lead to a worse branch then', M == 20) :-
    P = [call(f, a, 'Lighten'(r1, b1)), call(f, b, 'Lighten'(r1, b2)),
         foreach(f, e, [X-'Box'], holds(heavy, X, true), I, call(I, m, 'Move'(r1, X)))],
    best(choice(f, c, [P, call(f, d, 'Slow'(r1))]), plan(optimal, M, M, _, [], _)).
test('with the budget spent, an execution and a bound, called optimal only if they meet') :-
    looking(S),
    P = conc([call(f, a, 'Slow'(r1)), choice(f, c, [call(f, b, 'Slow'(r1)), call(f, d, 'Slow'(r2))])]),
    best_plan(P, S, 0, plan(Status, M, Bound, _, [], 0-_)),
    Bound =< 100, M >= 100,
    ( M == Bound -> Status == optimal ; Status == satisficing ).

:- end_tests(best_plan).

:- begin_tests(reduction, [setup(yard), cleanup(yard_gone)]).

test('steps without effects on one another are independent') :-
    looking(S), once(independent(conc([call(f, a, 'Slow'(r1)), call(f, b, 'Fill'(r2))]), S)).
test('a precondition that a step changes makes them dependent', fail) :-
    looking(S), independent(conc([call(f, a, 'Empty'(r1)), call(f, b, 'Fill'(r2))]), S).
test('so does a test', fail) :-
    looking(S), independent(conc([[test(holds(full, tank, true)), call(f, a, 'Slow'(r1))], call(f, b, 'Fill'(r2))]), S).
test('a for-each over individuals that no step changes does not') :-
    looking(S), P = foreach(f, e, [X-'Box'], holds(full, X, true), I, call(I, a, 'Fill'(r1))),
    once(independent(P, S)).
test('one over individuals that a step changes does', fail) :-
    looking(S), independent([call(f, a, 'Lighten'(r1, b1)),
                           foreach(f, e, [X-'Box'], holds(heavy, X, true), I, call(I, m, 'Move'(r1, X)))], S).
test('the calls of a program are those of all its branches, one robot standing for all that are alike',
     Heads == ['Fast'(r1), 'Slow'(r1)]) :-
    looking(S), calls([choice(f, c, [call(f, a, 'Fast'(r1)), []]), pick(f, p, R, 'Robot', call(f, b, 'Slow'(R)))], S, Heads).

:- end_tests(reduction).
