:- use_module(library(plunit)).
:- use_module(library(assoc)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(horizon)).
:- use_module(planner_golog(search)).
:- use_module(planner_golog(settling)).
:- use_module(planner_golog(transition)).
:- use_module(planner_golog(travel)).

% The constructs that transition.plt leaves out: priorities, interrupts, orders to be chosen, iteration,
% lookahead, deadlines; and steps of two robots, and claims. Fast takes 10, Slow 100, Fill and Drain change a tank.

site :-
    load_facts(
        [ kind(c, r1, 'Robot'), kind(c, r2, 'Robot'), kind(c, b1, 'Box'), kind(c, b2, 'Box'),
          fluent(c, dirty, b1, true), fluent(c, dirty, b2, true),
          agent(c, 'Fast'(R1), R1), duration(c, 'Fast'(_), fixed(10)),
          agent(c, 'Slow'(R2), R2), duration(c, 'Slow'(_), fixed(100)),
          agent(c, 'Fill'(R3, _), R3), duration(c, 'Fill'(_, _), fixed(10)), effect(c, 'Fill'(_, T3), fluent(full, T3), true),
          agent(c, 'Clean'(R4, _), R4), duration(c, 'Clean'(_, _), fixed(10)), effect(c, 'Clean'(_, B4), fluent(dirty, B4), false),
          agent(c, 'Carry'(R5, S5), R5), agent(c, 'Carry'(R6, S6), S6), duration(c, 'Carry'(_, _), fixed(50)),
          agent(c, 'Pass'(R7, _), R7), claims(c, 'Pass'(_, D7), D7), duration(c, 'Pass'(_, _), fixed(20)),
          agent(c, 'Cross'(R8, _), R8), claims(c, 'Cross'(_, D8), D8), keeps_robot(c, 'Cross'),
          definition(c, 'Cross'(R9, D9), F9, [call(F9, in, 'Pass'(R9, D9)), call(F9, on, 'Fast'(R9))]),
          definition(c, 'Fill all', F10, star(F10, turn, choice(F10, tank, [call(F10, a, 'Fill'(r1, t1)), call(F10, b, 'Fill'(r1, t2))]))),
          definition(c, 'Idle', _, []), effect(c, 'Idle', fluent(idled, it), true)
        ], _),
    S5 = S6, R5 = R6.

site_gone :- drop_facts(c, _).

acting(S) :- no_guide(Guide), situation(c, act(Guide), 2, 0, S).
along(Chosen, S) :- proposed_guide(Chosen, [], Guide), situation(c, act(Guide), 2, 0, S).
looking(S) :- no_travel(Travel), situation(c, plan(Travel), 2, 0, S).
best(P, Result) :- looking(S), best_plan(P, S, 10_000, Result).
makespan(P, M) :- best(P, plan(optimal, M, M, _, _, _)).

started(P, S, Ids) :-
    findall(Id, ( trans(P, S, _, T), log(T, [started(Id, _, _, _, _)|_]) ), Ids).
% What a program comes to if each step that has started ends at once, at most so many.
traced(0, P, S, P, S, []) :- !.
traced(N, P, S, Q, T, Ids) :-
    (   trans(P, S, P1, S1)
    ->  log(S1, [started(Id, Head, _, _, _)|_]),
        stop(Id, S1, S2), apply_effects(Head, S2, S3), settle(P1, S3, P2, S4),
        N1 is N - 1, Ids = [Id|More], traced(N1, P2, S4, Q, T, More)
    ;   Q = P, T = S, Ids = []
    ).

fast(Id, R, call(f, Id, 'Fast'(R))).

:- begin_tests(priorities, [setup(site), cleanup(site_gone)]).

test('the part before goes first', Ids == ['f/a']) :-
    fast(a, r1, P), fast(b, r1, Q), acting(S), started(pconc([P, Q]), S, Ids).
test('one after it makes a step where the part before can make none', Ids == ['f/b']) :-
    fast(a, r1, P), fast(b, r2, Q), acting(S), started(pconc([[test(holds(full, t1, true)), P], Q]), S, Ids).
test('other robots go on beside, once the first has begun what it can', Ids == ['f/b']) :-
    fast(a, r1, P), fast(b, r2, Q), acting(S), trans(pconc([P, Q]), S, R, T), !, started(R, T, Ids).
test('it is over when all parts are', Rs == [going, []]) :-
    fast(a, r1, P), fast(b, r2, Q), acting(S), trans(pconc([P, Q]), S, R, T), trans(R, T, R1, T1), !,
    stop('f/a', T1, T2), settle(R1, T2, R2, T3), ( R2 == [] -> A = [] ; A = going ),
    stop('f/b', T3, T4), settle(R2, T4, R3, _), Rs = [A, R3].
test('of nothing it is over') :- acting(S), once(final(pconc([]), S)).
test('without a part that can go on it cannot either', fail) :-
    acting(S), trans(pconc([test(holds(full, t1, true)), test(holds(full, t2, true))]), S, _, _).
test('the plan pays for the priority', M-N == 120-110) :-
    P = [call(f, a, 'Fast'(r1)), call(f, b, 'Slow'(r2))], Q = call(f, c, 'Fast'(r2)),
    makespan(pconc([Q, P]), N), makespan(pconc([[call(f, d, 'Fast'(r1)), Q], P]), M).

:- end_tests(priorities).

:- begin_tests(interrupts, [setup(site), cleanup(site_gone)]).

clean(interrupt(f, i, [B-'Box'], holds(dirty, B, true), call(f, clean, 'Clean'(r1, B)))).

test('it turns as long as its condition holds, for the first by name, then what it interrupts goes on',
     Ids-Dirty == ['f/clean', 'f/clean', 'f/a']-[false, false]) :-
    clean(I), fast(a, r1, P), acting(S), traced(5, pconc([I, P]), S, _, T, Ids),
    findall(V, ( member(B, [b1, b2]), fluent_value(dirty, B, V, T) ), Dirty).
test('where its condition does not hold, it does nothing', Ids == ['f/a']) :-
    fast(a, r1, P), acting(S),
    started(pconc([interrupt(f, i, [], holds(full, t1, true), call(f, z, 'Fast'(r1))), P]), S, Ids).
test('it ends with what it interrupts', R == []) :-
    fast(a, r2, P), acting(S), Off = interrupt(f, i, [], holds(full, t1, true), call(f, z, 'Fast'(r1))),
    trans(pconc([Off, P]), S, Q, T), !, stop('f/a', T, T1), settle(Q, T1, R, _).
test('but not in the middle of a turn', true(R \== [])) :-
    clean(I), fast(a, r2, P), acting(S), trans(pconc([I, P]), S, Q, T), trans(Q, T, Q1, T1), !,
    stop('f/a', T1, T2), settle(Q1, T2, R, _), R = pconc([[running('f/clean')|_]]).
test('alone it may end at once') :- clean(I), looking(S), once(final(I, S)).
test('what is not known yet does not trigger it', Ids == ['f/a']) :-
    fast(a, r1, P), looking(S),
    started(pconc([interrupt(f, i, [], is_true(loc(f, ok)), call(f, z, 'Fast'(r1))), P]), S, Ids).
test('a plan has its turns: the condition comes to hold on the way', M == 130) :-
    Clean = interrupt(f, i, [], all([holds(full, t1, true), holds(dirty, b1, true)]), call(f, clean, 'Clean'(r1, b1))),
    makespan(pconc([Clean, [call(f, a, 'Fill'(r1, t1)), call(f, b, 'Slow'(r1)), call(f, c, 'Fast'(r1))]]), M).

:- end_tests(interrupts).

:- begin_tests(any_order, [setup(site), cleanup(site_gone)]).

any(any_order(f, o, [call(f, a, 'Fast'(r1)), call(f, b, 'Fast'(r2)), call(f, c, 'Fast'(r1))])).

test('looking ahead, each part may be first', Ids == ['f/a', 'f/b', 'f/c']) :- any(P), looking(S), started(P, S, Ids).
test('parts do not overlap', Ids == []) :- any(P), looking(S), trans(P, S, Q, T), !, started(Q, T, Ids).
test('then one of the others, each once', Ids == ['f/b', 'f/c']) :-
    any(P), looking(S), trans(P, S, Q, T), !, stop('f/a', T, T1), settle(Q, T1, Q1, T2), started(Q1, T2, Ids).
test('acting, the guide says in which order', Ids == ['f/b', 'f/c', 'f/a']) :-
    any(P), along(['f/o/3'-2, 'f/o/2'-3, 'f/o/1'-1], S), traced(9, P, S, [], _, Ids).
test('with parts left it is not final', fail) :- any(P), looking(S), final(P, S).
test('of nothing it is') :- looking(S), once(final(any_order(f, o, []), S)).
test('the order that leads to the end is found', Chosen == [2, 1]) :-
    best(any_order(f, o, [[test(holds(full, t1, true)), call(f, a, 'Fast'(r1))], call(f, b, 'Fill'(r1, t1))]),
         plan(optimal, 20, 20, Events, [], _)),
    findall(N, member(chose(_, N), Events), Chosen).
test('where no order does, that is proven') :-
    best(any_order(f, o, [call(f, a, 'Fast'(r1)), test(holds(full, t1, true))]), none(proven, _)).
test('a part that needs nothing done is taken too', M == 10) :-
    makespan(any_order(f, o, [[], call(f, a, 'Fast'(r1)), []]), M).

:- end_tests(any_order).

:- begin_tests(iteration, [setup(site), cleanup(site_gone)]).

test('none is enough', M == 0) :- makespan(star(f, s, call(f, a, 'Fast'(r1))), M).
test('as often as what follows needs', M == 20) :-
    makespan([star(f, s, choice(f, c, [call(f, a, 'Fill'(r1, t1)), call(f, b, 'Fill'(r1, t2))])),
              test(all([holds(full, t1, true), holds(full, t2, true)]))], M).
test('at the end of a process, too, more turns may be needed', M == 20) :-
    makespan([call(f, all, 'Fill all'), test(all([holds(full, t1, true), holds(full, t2, true)]))], M).
test('a process that turns no time is possible as well', M == 10) :-
    makespan([call(f, all, 'Fill all'), call(f, z, 'Fast'(r1))], M).
test('acting, as often as the guide says', Ids == ['f/a', 'f/a', 'f/z']) :-
    along(['f/s/0'-again, 'f/s/1'-again], S),
    traced(9, [star(f, s, call(f, a, 'Fast'(r1))), call(f, z, 'Fast'(r1))], S, [], _, Ids).
test('as long as the guide says again, it does not end', fail) :-
    along(['f/s/0'-again], S), final(star(f, s, call(f, a, 'Fast'(r1))), S).
test('what turning cannot reach is not reached', Why == unknown) :-
    looking(S), best_plan([star(f, s, call(f, a, 'Fast'(r1))), test(holds(full, t1, true))], S, 50, none(Why, _)).

:- end_tests(iteration).

:- begin_tests(lookahead, [setup(site), cleanup(site_gone)]).

test('looking ahead, it is what is in it', Ids == ['f/a']) :- looking(S), started(search(call(f, a, 'Fast'(r1))), S, Ids).
test('acting, it waits for a plan', Ids == []) :- acting(S), started(search(call(f, a, 'Fast'(r1))), S, Ids).
test('with a plan, it goes on', Ids == ['f/a']) :-
    acting(S0), set_data(planned, true, S0, S), started(search(call(f, a, 'Fast'(r1))), S, Ids).
test('with nothing to do, it is over') :- acting(S), once(final(search([]), S)).
test('a branch that leads nowhere is not taken', M == 100) :-
    makespan(search([choice(f, c, [call(f, a, 'Fast'(r1)), call(f, b, 'Fill'(r1, t1))]), test(holds(full, t1, true)),
                     call(f, d, 'Fast'(r2)), call(f, e, 'Fast'(r2)), call(f, g, 'Fast'(r2)), call(f, h, 'Fast'(r2)),
                     call(f, i, 'Fast'(r2)), call(f, j, 'Fast'(r2)), call(f, k, 'Fast'(r2)), call(f, l, 'Fast'(r2)),
                     call(f, m, 'Fast'(r2))]), M).

:- end_tests(lookahead).

:- begin_tests(deadlines, [setup(site), cleanup(site_gone)]).

test('what ends in time is planned', M == 20) :-
    makespan(deadline(20, [call(f, a, 'Fast'(r1)), call(f, b, 'Fast'(r1))]), M).
test('what ends too late is proven to be unsolvable') :-
    best(deadline(19, [call(f, a, 'Fast'(r1)), call(f, b, 'Fast'(r1))]), none(proven, _)).
test('so is what waits too long before its last test') :-
    best(conc([deadline(50, test(holds(full, t1, true))), [call(f, a, 'Slow'(r1)), call(f, b, 'Fill'(r1, t1))]]), none(proven, _)).
test('it counts from when the request began', M == 110) :-
    makespan([call(f, a, 'Slow'(r1)), deadline(110, call(f, b, 'Fast'(r1)))], M).
test('so that what has come before may use it up') :-
    best([call(f, a, 'Slow'(r1)), deadline(109, call(f, b, 'Fast'(r1)))], none(proven, _)).
test('another branch is taken where one would be late', Chosen == 2) :-
    best(deadline(50, choice(f, c, [call(f, a, 'Slow'(r1)), call(f, b, 'Fast'(r1))])), plan(optimal, 10, 10, Events, [], _)),
    memberchk(chose('f/c', Chosen), Events).
test('a loop that has ended in time is in time, however long something else goes on', M == 100) :-
    makespan(conc([deadline(50, while(not(holds(full, t1, true)), call(f, b, 'Fill'(r1, t1)))), call(f, a, 'Slow'(r2))]), M).
test('acting, what is late goes on', Ids == ['f/a']) :-
    acting(S0), at_time(S0, 1000, S), started(deadline(20, call(f, a, 'Fast'(r1))), S, Ids).

:- end_tests(deadlines).

:- begin_tests(together, [setup(site), cleanup(site_gone)]).

test('a step of two robots begins when both are idle', M == 150) :-
    makespan(conc([call(f, a, 'Carry'(r1, r2)), call(f, b, 'Slow'(r2))]), M).
test('both are busy with it', Ids == []) :-
    fast(b, r2, P), acting(S), trans(call(f, a, 'Carry'(r1, r2)), S, R, T), !, started(conc([R, P]), T, Ids).
test('one robot is not two') :- best(call(f, a, 'Carry'(r1, r1)), none(proven, _)).
test('nor may two take part where one may', fail) :-
    no_guide(Guide), situation(c, act(Guide), 1, 0, S), trans(call(f, a, 'Carry'(r1, r2)), S, _, _).
test('what is claimed serves one at a time', M == 40) :-
    makespan(conc([call(f, a, 'Pass'(r1, door)), call(f, b, 'Pass'(r2, door))]), M).
test('a process claims for all of its steps', M == 60) :-
    makespan(conc([call(f, a, 'Cross'(r1, door)), call(f, b, 'Cross'(r2, door))]), M).
test('its own steps use what it has', M == 30) :- makespan(call(f, a, 'Cross'(r1, door)), M).
test('the robot of a process that keeps it does nothing else meanwhile', Order == ['f/a/in', 'f/a/on', 'f/b']) :-
    best(conc([call(f, a, 'Cross'(r1, door)), call(f, b, 'Slow'(r1))]), plan(optimal, 130, 130, Events, [], _)),
    findall(Id, member(started(Id, _, _, _, _), Events), Ids), ( Ids = ['f/b'|Rest] -> append(Rest, ['f/b'], Order) ; Order = Ids ).

:- end_tests(together).

:- begin_tests(nothing_to_do, [setup(site), cleanup(site_gone)]).

test('a process with nothing to do has its effects as a branch', M == 0) :-
    makespan([choice(f, c, [call(f, i, 'Idle')]), test(holds(idled, it, true))], M).
test('and after a loop that does not turn', M == 0) :-
    makespan([while(holds(full, t1, true), call(f, a, 'Fast'(r1))), call(f, i, 'Idle'), test(holds(idled, it, true))], M).
test('and in a condition', M == 10) :-
    makespan([if(holds(full, t1, true), [], call(f, i, 'Idle')), test(holds(idled, it, true)), call(f, a, 'Fast'(r1))], M).

:- end_tests(nothing_to_do).
