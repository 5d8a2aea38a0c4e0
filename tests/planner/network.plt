:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(network)).
:- use_module(planner_golog(travel)).

% r1 and r2 are alike, r3 is a lifter; Go travels; Fill makes full what Use needs.

plant :-
    load_facts(
        [ kind(n, r1, 'Robot'), kind(n, r2, 'Robot'), kind(n, r3, 'Robot'), kind(n, r3, 'Lifter'),
          kind(n, b1, 'Box'), kind(n, b2, 'Box'), value(n, stands, b1, p1), value(n, stands, b2, p2),
          value(n, energy_J, r3, 10), value(n, power_W, r3, 5), value(n, capacity, dock, 2),
          agent(n, 'Go'(R1, _), R1), duration(n, 'Go'(R2, X2), travel(R2, X2, 5)), effect(n, 'Go'(R3, X3), fluent(locatedAt, R3), X3),
          odds(n, 'Go', 0.5),
          agent(n, 'Work'(R4), R4), duration(n, 'Work'(_), fixed(10)),
          agent(n, 'Lift'(R5), R5), duration(n, 'Lift'(_), fixed(20)), requires(n, 'Lift', 'Lifter'),
          agent(n, 'Carry'(R6, S6), R6), agent(n, 'Carry'(R7, S7), S7), duration(n, 'Carry'(_, _), fixed(50)),
          agent(n, 'Pass'(R8, _), R8), claims(n, 'Pass'(_, D8), D8), duration(n, 'Pass'(_, _), fixed(30)),
          agent(n, 'Fill'(R9), R9), duration(n, 'Fill'(_), fixed(10)), effect(n, 'Fill'(_), fluent(full, tank), true),
          agent(n, 'Use'(R10), R10), duration(n, 'Use'(_), fixed(10)), precondition(n, 'Use'(_), holds(full, tank, true)),
          agent(n, 'Broken'(R11), R11), duration(n, 'Broken'(_), fixed(10)), precondition(n, 'Broken'(_), holds(never, it, true)),
          agent(n, 'Seek'(R12, _), R12), keeps_robot(n, 'Seek'), claims(n, 'Seek'(_, X12), X12),
          definition(n, 'Seek'(R13, X13), F13, [call(F13, go, 'Go'(R13, X13)), call(F13, work, 'Work'(R13))])
        ], _),
    S6 = R7, R6 = S7.

plant_gone :- drop_facts(n, _).

looking(S) :-
    travel(tables([p1, p2], [robot(r1, 1, [1, 2]), robot(r2, 1, [3, 4]), robot(r3, 1, [5, 6])], [[[0, 9], [9, 0]]]), Travel),
    situation(n, plan(Travel), 2, 0, S).
root(P, Root) :- looking(S), network(P, S, network(Root, _, _, _, _, _)).
exact(P, Exact) :- looking(S), network(P, S, network(_, _, _, _, _, Exact)).

work(Id, R, call(f, Id, 'Work'(R))).
worked(Id, R, step(Id, [R], none, 1, 10, [none], [])).

:- begin_tests(network, [setup(plant), cleanup(plant_gone)]).

test('a sequence', R == seq([A, B])) :- work(a, r1, P), work(b, r2, Q), worked('f/a', r1, A), worked('f/b', r2, B), root([P, Q], R).
test('side by side', R == side([A, B])) :- work(a, r1, P), work(b, r2, Q), worked('f/a', r1, A), worked('f/b', r2, B), root(conc([P, Q]), R).
test('nothing', R == seq([])) :- root([], R).
test('any order', R == any_order('f/o', [A, B])) :-
    work(a, r1, P), work(b, r2, Q), worked('f/a', r1, A), worked('f/b', r2, B), root(any_order(f, o, [P, Q]), R).
test('a choice', R == alt('f/c', [option([1], A), option([2], seq([]))])) :-
    work(a, r1, P), worked('f/a', r1, A), root(choice(f, c, [P, []]), R).
test('a branch that nobody can do is left out', R == alt('f/c', [option([2], A)])) :-
    work(a, r1, P), worked('f/a', r1, A), root(choice(f, c, [call(f, l, 'Lift'(r1)), P, call(f, x, 'Broken'(r1))]), R).
test('robots that are alike share an option', R == alt('f/p', [option([r1, r2, r3], A)])) :-
    worked('f/a', '?f/p', A), root(pick(f, p, X, 'Robot', call(f, a, 'Work'(X))), R).
test('unless the program asks for what one of them is', R == alt('f/p', [option([r1, r2], A), option([r3], seq([B, L]))])) :-
    worked('f/a', '?f/p', A0), A = seq([A0, alt('f/c', [option([1], seq([]))])]), worked('f/a', r3, B),
    L = alt('f/c', [option([1], seq([])), option([2], step('f/l', [r3], none, 1, 20, [none], []))]),
    root(pick(f, p, X, 'Robot', [call(f, a, 'Work'(X)), choice(f, c, [[], call(f, l, 'Lift'(X))])]), R).
test('what is excluded is no option', R == alt('f/p', [option([r2, r3], A)])) :-
    worked('f/a', '?f/p', A), looking(S0), exclude('f/p', r1, S0, S),
    network(pick(f, p, X, 'Robot', call(f, a, 'Work'(X))), S, network(R, _, _, _, _, _)).
test('a condition that nothing before changes is decided', R == A) :-
    work(a, r1, P), worked('f/a', r1, A), root(if(holds(stands, b1, p1), P, []), R).
test('one that something changes is left open: a relaxation', R-Exact == seq([Fill, alt(none, [option([1], A), option([2], seq([]))])])-false) :-
    work(a, r1, P), worked('f/a', r1, A), Fill = step('f/b', [r2], none, 1, 10, [none], []),
    Q = [call(f, b, 'Fill'(r2)), if(holds(full, tank, true), P, [])], root(Q, R), exact(Q, Exact).
test('a for-each has its turns', R == side([A, B])) :-
    worked('f/e/b1/w', r1, A), worked('f/e/b2/w', r1, B),
    root(foreach(f, e, [X-'Box'], holds(stands, X, _), I, call(I, w, 'Work'(r1))), R).
test('a while loop that does not turn is nothing', R == seq([])) :- work(a, r1, P), root(while(holds(full, tank, true), P), R).
test('a test that holds is nothing', R == seq([])) :- root(test(holds(stands, b1, p1)), R).
test('lookahead is what is in it', R == A) :- work(a, r1, P), worked('f/a', r1, A), root(search(P), R).
test('a deadline', R == by(70, A)) :-
    work(a, r1, P), worked('f/a', r1, A), looking(S0), at_time(S0, 30, S), network(deadline(100, P), S, network(R, _, _, _, _, _)).
test('a step that travels: where to, its odds, where it ends', R == step('f/g', [r1], p1, 0.5, 10, [p1], [])) :-
    root(call(f, g, 'Go'(r1, p1)), R).
test('a step of two robots', R == step('f/c', [r1, r2], none, 1, 50, [none, none], [])) :- root(call(f, c, 'Carry'(r1, r2)), R).
test('a claim', R == step('f/d', [r1], none, 1, 30, [none], [door])) :- root(call(f, d, 'Pass'(r1, door)), R).
test('a process that keeps its robot and claims a place', R == claimed('f/s', [p1], held('f/s', r1, seq([Go, A])))) :-
    Go = step('f/s/go', [r1], p1, 0.5, 10, [p1], []), worked('f/s/work', r1, A), root(call(f, s, 'Seek'(r1, p1)), R).
test('what is under way', R == seq([underway('f/a', [r1], 6, [none], []), A])) :-
    work(b, r1, P), worked('f/b', r1, A), looking(S0), begin_step('f/a', 'Work'(r1), [r1], 10, S0, S1), at_time(S1, 4, S),
    network([running('f/a'), P], S, network(R, _, _, _, _, _)).
test('robots with what they can work, the team, capacities', Rs-Team-C == [robot(r1, here, none), robot(r2, here, none), robot(r3, here, 2000)]-2-[dock-2]) :-
    looking(S), network([], S, network(_, Rs, Team, _, C, _)).

test('one nobody can do', N == none) :- looking(S), network(call(f, l, 'Lift'(r1)), S, N).
test('one robot cannot be two', N == none) :- looking(S), network(call(f, c, 'Carry'(r1, r1)), S, N).
test('a test that does not hold at first', N == none) :- looking(S), network(test(holds(full, tank, true)), S, N).
test('a choice without branches', N == none) :- looking(S), network(choice(f, c, []), S, N).
test('a precondition that another step changes is left out', R-Exact == side([Fill, Use])-false) :-
    Fill = step('f/a', [r1], none, 1, 10, [none], []), Use = step('f/b', [r2], none, 1, 10, [none], []),
    P = conc([call(f, a, 'Fill'(r1)), call(f, b, 'Use'(r2))]), root(P, R), exact(P, Exact).
test('steps that have nothing to do with one another: exact', Exact == true) :-
    work(a, r1, P), exact([P, call(f, g, 'Go'(r2, p1))], Exact).
test('where only acting tells how to go on, a plan may end there: none', [forall(member(P, [if(C, W, W), [W, test(C), W], foreach(f, e, [_-'Box'], C, _, W)])),
                                                                         throws(error(no_network(sensing), _))]) :-
    C = is_true(loc(f, x)), work(a, r1, W), root(P, _).
test('what acting has found out already is known', R == A) :-
    work(a, r1, P), worked('f/a', r1, A), looking(S0), set_data(loc(f, x), true, S0, S),
    network(if(is_true(loc(f, x)), P, []), S, network(R, _, _, _, _, _)).
test('what depends on what is done before has none',
     [forall(member(P-What, [ pconc([])-prioritized, interrupt(f, i, [], all([]), W)-interrupt, star(f, s, W)-iterate, until(W, any([]))-repeat_until,
                             while(all([]), W)-repeat_while, [call(f, b, 'Fill'(r2)), while(holds(full, tank, true), W)]-repeat_while ])),
      throws(error(no_network(What), _))]) :-
    work(a, r1, W), root(P, _).

:- end_tests(network).
